//! The replay buffer: a ring of transitions and uniform minibatches from it.
//!
//! One transition is one contiguous row, so that a minibatch touches as few cache lines as
//! possible. The next observation of a step usually equals the observation of the following step, so
//! it is stored only once, in the following row, unless an episode ends there. Storage grows with
//! the recorded transitions, up to the capacity. Copies share it, except for what one of them records.

use std::sync::Arc;

use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use mge_base::streams;

mod codec;

/// One step of experience, `(s, a, r, s', d)`, borrowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transition<'a> {
    /// `s`: the observation.
    pub observation: &'a [f32],
    /// `a`: the action, each component in [-1, 1].
    pub action: &'a [f32],
    /// `r`: the reward.
    pub reward: f32,
    /// `s'`: the next observation. At a time limit this is the true last observation of the episode,
    /// not the first of the next one.
    pub next_observation: &'a [f32],
    /// `d`: whether `s'` is a terminal state, after which no reward is possible. The last transition
    /// of a truncated episode is stored with `false`, so that its value is still bootstrapped from `s'`.
    pub terminated: bool,
}

/// A minibatch of `n` transitions, row-major, filled by [`ReplayBuffer::sample`] and reused.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Batch {
    /// `s`, shape `[n, observation_len]`.
    pub observations: Vec<f32>,
    /// `a`, shape `[n, action_len]`.
    pub actions: Vec<f32>,
    /// `r`, shape `[n]`.
    pub rewards: Vec<f32>,
    /// `s'`, shape `[n, observation_len]`.
    pub next_observations: Vec<f32>,
    /// `d`, shape `[n]`.
    pub terminated: Vec<bool>,
    /// M: the number of transitions, at the end of the batch, from segments that reached their stage.
    pub imitated: usize,
}

impl Batch {
    /// Number of transitions.
    pub fn len(&self) -> usize {
        self.rewards.len()
    }

    /// Whether there is no transition.
    pub fn is_empty(&self) -> bool {
        self.rewards.is_empty()
    }

    /// Appends one transition.
    pub fn push(&mut self, transition: Transition<'_>) {
        self.observations.extend_from_slice(transition.observation);
        self.actions.extend_from_slice(transition.action);
        self.rewards.push(transition.reward);
        self.next_observations.extend_from_slice(transition.next_observation);
        self.terminated.push(transition.terminated);
    }

    /// Removes all transitions and keeps the memory.
    pub fn clear(&mut self) {
        self.observations.clear();
        self.actions.clear();
        self.rewards.clear();
        self.next_observations.clear();
        self.terminated.clear();
        self.imitated = 0;
    }
}

/// Why a replay buffer rejected a transition or its saved bytes.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ReplayError {
    /// A number of the transition is NaN or infinite and would poison the networks.
    #[error("a transition has a number that is not finite: nothing can be learned from it")]
    NotFinite,
    /// The bytes are not a replay buffer written by [`ReplayBuffer::to_bytes`].
    #[error("the saved replay buffer is damaged ({0}): a fork can continue from an earlier checkpoint")]
    Damaged(&'static str),
}

/// Largest capacity of a buffer.
pub(super) const MAX_CAPACITY: usize = 10_000_000;

/// A ring of the latest `capacity` transitions.
#[derive(Clone, Debug, PartialEq)]
pub struct ReplayBuffer {
    /// Length of an observation.
    pub(super) observation_len: usize,
    /// Length of an action.
    pub(super) action_len: usize,
    /// Number of transitions after which the oldest is overwritten.
    pub(super) capacity: usize,
    /// Slot that the next transition is written to.
    next: usize,
    len: usize,
    /// The slots, [`CHUNK`] in each part, as rows `[s, a, r, d, s']`.
    chunks: Vec<Arc<Vec<f32>>>,
}

/// Slots in a part of the storage that copies of a buffer share.
const CHUNK: usize = 1024;

impl ReplayBuffer {
    /// An empty buffer for vectors of the given lengths. A `capacity` of 0 is treated as 1.
    pub fn new(observation_len: usize, action_len: usize, capacity: usize) -> Self {
        Self { observation_len, action_len, capacity: capacity.max(1), next: 0, len: 0, chunks: Vec::new() }
    }

    /// Number of transitions held.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether no transition is held.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The transition in slot `index`, or `None` if the slot is empty. Slots are in order of age
    /// until the buffer is full; then the oldest is overwritten first.
    pub fn get(&self, index: usize) -> Option<Transition<'_>> {
        let row = self.chunks.get(index / CHUNK)?.get(index % CHUNK * self.stride()..)?.get(..self.stride())?;
        let (observation, row) = row.split_at(self.observation_len);
        let (action, row) = row.split_at(self.action_len);
        let (reward, terminated, next_observation) = (row[0], row[1] != 0.0, &row[2..]);
        Some(Transition { observation, action, reward, next_observation, terminated })
    }

    /// Records a transition; overwrites the oldest one if the buffer is full.
    ///
    /// # Errors
    /// If a number is not finite; then nothing is recorded.
    ///
    /// # Panics
    /// If a vector has the wrong length.
    pub fn push(&mut self, transition: Transition<'_>) -> Result<(), ReplayError> {
        let Transition { observation, action, reward, next_observation, terminated } = transition;
        let parts = [observation, action, &[reward, f32::from(terminated)], next_observation];
        if parts.iter().any(|part| part.iter().any(|value| !value.is_finite())) {
            return Err(ReplayError::NotFinite);
        }
        let (slot, stride) = (self.next, self.stride());
        if slot == self.len {
            if slot.is_multiple_of(CHUNK) {
                self.chunks.push(Arc::default());
            }
            self.len += 1;
        }
        let rows = Arc::make_mut(&mut self.chunks[slot / CHUNK]);
        let mut at = slot % CHUNK * stride;
        rows.resize(rows.len().max(at + stride), 0.0);
        for (part, length) in parts.into_iter().zip([self.observation_len, self.action_len, 2, self.observation_len]) {
            rows[at..at + length].copy_from_slice(part);
            at += length;
        }
        self.next = (slot + 1) % self.capacity;
        Ok(())
    }

    /// Fills `batch` with `count` transitions drawn uniformly with replacement; leaves it empty if the
    /// buffer is empty.
    pub fn sample(&self, count: usize, rng: &mut ChaCha8Rng, batch: &mut Batch) {
        batch.clear();
        for _ in 0..if self.is_empty() { 0 } else { count } {
            let index = streams::index(rng, self.len());
            batch.push(self.get(index).expect("the index is below the length"));
        }
    }

    /// The transition recorded `age` transitions before the latest one, if it is still held.
    pub fn latest(&self, age: usize) -> Option<Transition<'_>> {
        let slot = (age < self.len()).then(|| (self.next + self.capacity - 1 - age) % self.capacity);
        self.get(slot?)
    }

    fn stride(&self) -> usize {
        2 * self.observation_len + self.action_len + 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    fn numbered(buffer: &mut ReplayBuffer, range: std::ops::Range<usize>) {
        for i in range {
            let x = i as f32;
            buffer
                .push(Transition {
                    observation: &[x, 0.5],
                    action: &[-x],
                    reward: 10.0 * x,
                    next_observation: &[x + 1.0, 0.5],
                    terminated: i % 3 == 0,
                })
                .unwrap();
        }
    }

    #[test]
    fn copies_share_what_neither_has_changed() {
        let mut buffer = ReplayBuffer::new(2, 1, 3 * CHUNK);
        numbered(&mut buffer, 0..3 * CHUNK + 5);
        let before = buffer.to_bytes();
        let mut copy = buffer.clone();
        numbered(&mut copy, 0..5);
        let shared = || buffer.chunks.iter().zip(&copy.chunks).map(|(a, b)| Arc::ptr_eq(a, b));
        assert_eq!(shared().collect::<Vec<_>>(), [false, true, true]);
        assert_eq!(buffer.to_bytes(), before);
        assert_eq!(copy.get(5).unwrap().reward, 0.0);
    }

    #[test]
    fn the_oldest_transition_is_overwritten() {
        let mut buffer = ReplayBuffer::new(2, 1, 4);
        numbered(&mut buffer, 0..6);
        let rewards: Vec<f32> = (0..4).map(|i| buffer.get(i).unwrap().reward).collect();
        assert_eq!(rewards, [40.0, 50.0, 20.0, 30.0]);
        assert_eq!((buffer.len(), buffer.get(4)), (4, None));
        let kept = buffer.get(3).unwrap();
        assert_eq!(
            kept,
            Transition {
                observation: &[3.0, 0.5],
                action: &[-3.0],
                reward: 30.0,
                next_observation: &[4.0, 0.5],
                terminated: true
            }
        );
    }

    #[test]
    fn the_latest_transitions_are_found_by_age() {
        for (count, held) in [(3, 3), (6, 4)] {
            let mut buffer = ReplayBuffer::new(2, 1, 4);
            numbered(&mut buffer, 0..count);
            for age in 0..held {
                assert_eq!(buffer.latest(age).unwrap().reward, 10.0 * (count - 1 - age) as f32);
            }
            assert_eq!(buffer.latest(held), None);
        }
    }

    #[test]
    fn samples_are_whole_transitions_drawn_uniformly() {
        let mut buffer = ReplayBuffer::new(2, 1, 10);
        numbered(&mut buffer, 0..10);
        let (mut batch, mut counts) = (Batch::default(), [0; 10]);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..100 {
            buffer.sample(100, &mut rng, &mut batch);
            assert_eq!((batch.len(), batch.is_empty()), (100, false));
            for (i, &reward) in batch.rewards.iter().enumerate() {
                let slot = (reward / 10.0) as usize;
                let of_batch = Transition {
                    observation: &batch.observations[2 * i..2 * i + 2],
                    action: &batch.actions[i..=i],
                    reward,
                    next_observation: &batch.next_observations[2 * i..2 * i + 2],
                    terminated: batch.terminated[i],
                };
                assert_eq!(buffer.get(slot), Some(of_batch));
                counts[slot] += 1;
            }
        }
        // 1000 expected, standard deviation 30.
        assert!(counts.iter().all(|count| (850..1150).contains(count)), "{counts:?}");
    }

    #[test]
    fn an_empty_buffer_gives_an_empty_batch() {
        let mut batch = Batch::default();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        ReplayBuffer::new(2, 1, 10).sample(5, &mut rng, &mut batch);
        assert!(batch.is_empty());
    }

    #[test]
    fn an_empty_buffer_of_long_observations_is_restored() {
        let empty = ReplayBuffer::new(4000, 3, 10);
        assert_eq!(ReplayBuffer::from_bytes(&empty.to_bytes()).unwrap(), empty);
    }

    #[test]
    fn transitions_that_are_not_finite_are_refused() {
        let mut buffer = ReplayBuffer::new(2, 1, 4);
        let good = Transition {
            observation: &[0.0, 0.0],
            action: &[0.0],
            reward: 0.0,
            next_observation: &[0.0, 0.0],
            terminated: false,
        };
        for wrong in
            [Transition { next_observation: &[0.0, f32::NAN], ..good }, Transition { reward: f32::INFINITY, ..good }]
        {
            assert_eq!(buffer.push(wrong), Err(ReplayError::NotFinite));
        }
        assert!(buffer.is_empty());
        buffer.push(good).unwrap();
    }
}
