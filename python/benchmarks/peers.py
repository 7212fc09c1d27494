"""Agents of other libraries on the puzzles: success against actions, wall time and processor time.

    pip install ./python stable-baselines3 sbx-rl
    python python/benchmarks/peers.py task1 sb3-td3 --seed 0 --steps 20000 --start-noise 0.01 --out peers

Writes `peers/TASK-ALGORITHM-seedN.csv`, with a row after every `--every` actions. `success` is the share of the
latest 100 training episodes that reached the goal, as in our runs; `greedy` is that of `--evaluations` episodes
without exploration. `wall_seconds` and `cpu_seconds` (all threads) are for the training alone.

Each algorithm has its library's defaults except for the discount, which is ours (0.95), and action noise for
TD3 and DDPG, which have none by default; `--set learning_rate=3e-4` changes a setting.
"""

import argparse
import csv
import json
import time
from pathlib import Path

import numpy as np

import mge
from mge.sb3 import PuzzleVecEnv


def noise():
    from stable_baselines3.common.noise import NormalActionNoise

    return {"action_noise": NormalActionNoise(np.zeros(2), 0.2 * np.ones(2))}


# DroQ is SAC with dropout and layer normalisation in critics that are updated 20 times per action.
DROQ = {
    "policy_kwargs": {"dropout_rate": 0.01, "layer_norm": True},
    "gradient_steps": 20,
    "policy_delay": 20,
}
# Library, class, settings that differ from the library's defaults.
ALGORITHMS = {
    "sb3-ddpg": ("stable_baselines3", "DDPG", noise),
    "sb3-td3": ("stable_baselines3", "TD3", noise),
    "sb3-sac": ("stable_baselines3", "SAC", dict),
    "sb3-ppo": ("stable_baselines3", "PPO", dict),
    "sbx-td3": ("sbx", "TD3", noise),
    "sbx-sac": ("sbx", "SAC", dict),
    "sbx-crossq": ("sbx", "CrossQ", dict),
    "sbx-droq": ("sbx", "SAC", lambda: DROQ),
}
COLUMNS = ["task", "algorithm", "seed", "start_noise", "actions", "episodes", "success", "greedy", "wall_seconds", "cpu_seconds"]


def greedy_success(model, task, episodes, seed):
    """The share of episodes without exploration that reach the goal."""
    envs = PuzzleVecEnv(task, episodes, num_threads=1)
    envs.seed(seed)
    observations, goal, over = envs.reset(), np.zeros(episodes, bool), np.zeros(episodes, bool)
    while not over.all():
        actions, _ = model.predict(observations, deterministic=True)
        observations, _, dones, infos = envs.step(actions)
        for i in np.flatnonzero(dones & ~over):
            goal[i] = infos[i]["is_success"]
        over |= dones
    return goal.mean()


def train(options, write):
    """Trains one agent and passes the rows to `write`."""
    import importlib

    import torch
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.vec_env import VecMonitor

    torch.set_num_threads(1)  # faster for small networks
    task = mge.Task(options.task)
    start_noise = json.loads(task.to_json())["rules"].get("start_noise", 0.0)
    if options.start_noise is not None:
        task, start_noise = mge.Task(task, start_noise=options.start_noise), options.start_noise
    library, name, settings = ALGORITHMS[options.algorithm]
    settings = {"gamma": 0.95, **settings(), **dict(options.set)}
    model = getattr(importlib.import_module(library), name)(
        "MlpPolicy", VecMonitor(PuzzleVecEnv(task, options.envs, num_threads=1)), seed=options.seed, **settings
    )

    class Recorder(BaseCallback):
        """Writes a row after every `--every` actions. Its own time is not counted as training time."""

        episodes = 0
        due = options.every
        wall, cpu = time.perf_counter(), time.process_time()

        def _on_step(self):
            self.episodes += int(self.locals["dones"].sum())
            if self.num_timesteps >= self.due:
                self.due += options.every
                self.record()
            return True

        def record(self):
            wall, cpu = time.perf_counter() - self.wall, time.process_time() - self.cpu
            done = self.model.ep_success_buffer
            greedy = greedy_success(self.model, task, options.evaluations, 10_000 + options.seed)
            row = [options.task, options.algorithm, options.seed, start_noise, self.num_timesteps, self.episodes]
            success = np.mean(done) if done else 0.0
            write([*row, round(float(success), 4), round(float(greedy), 4), round(wall, 2), round(cpu, 2)])
            self.wall, self.cpu = time.perf_counter() - wall, time.process_time() - cpu

    model.learn(options.steps, callback=Recorder())


def setting(text):
    name, equals, value = text.partition("=")
    if not equals:
        raise argparse.ArgumentTypeError(f"`{text}` is not NAME=VALUE")
    try:
        return name, json.loads(value)
    except ValueError:
        return name, value


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("task", help="a task's name or file")
    parser.add_argument("algorithm", choices=ALGORITHMS)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--steps", type=int, default=20_000, help="actions to train for (default 20000)")
    parser.add_argument("--start-noise", type=float, help="replaces the task's")
    parser.add_argument("--envs", type=int, default=1, help="parallel environments (default 1)")
    parser.add_argument("--every", type=int, default=1000, help="actions between rows (default 1000)")
    parser.add_argument("--evaluations", type=int, default=100, help="episodes without exploration per row (default 100)")
    parser.add_argument("--set", type=setting, action="append", default=[], metavar="NAME=VALUE", help="a setting of the algorithm")
    parser.add_argument("--out", type=Path, default=Path("peers"), help="folder (default peers)")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / f"{Path(options.task).stem}-{options.algorithm}-seed{options.seed}.csv"
    with open(path, "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")

        def write(row):
            writer.writerow(row)
            file.flush()
            print(*row, sep=",", flush=True)

        write(COLUMNS)
        train(options, write)
    print(path)


if __name__ == "__main__":
    main()
