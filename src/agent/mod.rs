//! DDPG: actor, critic, replay buffer, exploration noise, update. Knows vectors, not puzzles.
