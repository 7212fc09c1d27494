"""Trains Stable-Baselines3's DDPG on a task for some steps: a user's agent on our environment.

    pip install stable-baselines3
    python tests/python/check_stable_baselines3.py MGE_PROGRAM
"""

import sys
from pathlib import Path

import numpy as np
import torch
from stable_baselines3 import DDPG
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.noise import OrnsteinUhlenbeckActionNoise

sys.path.insert(0, str(Path(__file__).parents[2] / "assets" / "python"))
from mge_gym import MgeEnv  # noqa: E402


def main(program):
    torch.set_num_threads(1)
    env = Monitor(MgeEnv("task1", program=[program]))
    noise = OrnsteinUhlenbeckActionNoise(np.zeros(2), 0.2 * np.ones(2))
    model = DDPG("MlpPolicy", env, action_noise=noise, learning_starts=50, seed=0)
    before = [parameter.detach().clone() for parameter in model.actor.parameters()]
    model.learn(300)
    assert any((old != new).any() for old, new in zip(before, model.actor.parameters())), "nothing was learned"
    episodes = env.get_episode_rewards()
    assert len(episodes) > 5 and np.isfinite(episodes).all(), episodes
    env.close()
    print(f"Stable-Baselines3 trained for {len(episodes)} episodes, mean return {np.mean(episodes):.2f}")


if __name__ == "__main__":
    main(sys.argv[1])
