"""DDPG of Stable-Baselines3 on task1; with `--guided`, guided by our dynamics model."""

import sys

import mge
import numpy as np
import torch
from mge.sb3 import PuzzleVecEnv
from stable_baselines3 import DDPG
from stable_baselines3.common.noise import NormalActionNoise
from stable_baselines3.common.vec_env import VecMonitor


class Guided(DDPG):
    """Takes a decreasing share of actions from the clusters of the next stage."""

    def _sample_action(self, learning_starts, action_noise=None, n_envs=1):
        actions, stored = super()._sample_action(learning_starts, action_noise, n_envs)
        epsilon = 0.5 * max(0.0, 1 - 2 * self.num_timesteps / steps)
        stages = self._last_obs[:, 160:].argmax(axis=1)
        for i in np.flatnonzero(random.random(n_envs) < epsilon):
            actions[i] = stored[i] = prior.sample(stages[i], 1, seed=int(random.integers(2**63)))[0]
        return actions, stored


torch.set_num_threads(1)  # faster for small networks
random, task = np.random.default_rng(0), mge.Task("task1")
steps = int(next((word for word in sys.argv[1:] if word.isdigit()), 20_000))
guided = "--guided" in sys.argv
if guided:
    prior = mge.build_prior(task, mge.Model.shipped_for(task), seed=0)
agent = (Guided if guided else DDPG)(
    "MlpPolicy",
    VecMonitor(PuzzleVecEnv(task, 4)),
    gamma=0.95,
    learning_starts=500,
    gradient_steps=4,
    policy_kwargs={"net_arch": [64, 64]},
    seed=0,
)
for tenth in range(10):
    # No noise in the second half: the box must be placed to within about 0.035.
    agent.action_noise = NormalActionNoise(np.zeros(2), 0.2 * max(0, 1 - tenth / 5) * np.ones(2))
    agent.learn(steps // 10, reset_num_timesteps=tenth == 0)
    # Rolling success over the last 100 episodes, as in mge's runs.
    print(f"{agent.num_timesteps:6} actions: success {np.mean(agent.ep_success_buffer):.2f}", flush=True)
