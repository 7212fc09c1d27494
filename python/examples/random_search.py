"""Random search on a task: 1024 environments, one call per step."""

import sys

import gymnasium
import mge  # registers the tasks with Gymnasium
import numpy as np

task, steps = sys.argv[1] if len(sys.argv) > 1 else "task1", int(sys.argv[2]) if len(sys.argv) > 2 else 1000
envs = gymnasium.make_vec(f"mge/{task}-v0", num_envs=1024, autoreset_mode="SameStep")
envs.reset(seed=0)
envs.action_space.seed(0)

episodes = goals = 0
total, best = np.zeros(1024), -np.inf
for _ in range(steps):
    _, rewards, terminated, truncated, infos = envs.step(envs.action_space.sample())
    total += rewards
    over = terminated | truncated
    if over.any():
        episodes += over.sum()
        goals += infos["final_info"]["is_success"].sum()
        best = max(best, total[over].max())
        total[over] = 0
print(f"{goals} of {episodes} random episodes of {task} reached the goal; the best return is {best:.2f}")
