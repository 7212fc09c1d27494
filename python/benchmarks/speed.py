"""Speed of the environments: ours, those of other libraries, and Rust alone.

    pip install ./python envpool stable-baselines3 sbx-rl
    python python/benchmarks/speed.py [--create FOLDER] [--seconds 3] [part ...]

Parts: random (random actions in vector environments), rust (the same work in Rust alone; with
cargo, also its benchmark), create (CREATE itself, from a clone of its repository; needs gym 0.21, pymunk
5.7, pygame, pillow and opencv-python), others (EnvPool's, Gymnasium's), trainers (Stable-Baselines3 and SBX), memory
(10 million steps). Without names, all parts run. Packages that are not installed are skipped with a note. Prints
Markdown.

Rates are per wall time and per CPU time of the process (all threads); other work on the machine hardly affects the
latter. The best of five runs counts.
"""

import argparse
import importlib.util
import json
import os
import resource
import shutil
import subprocess
import sys
import time

import gymnasium
import numpy as np

import mge


def rate(step, actions_a_step, seconds):
    """Actions per second of wall time and of CPU time: the best of five runs that take a fifth of `seconds` each."""
    best = [0.0, 0.0]
    for _ in range(5):
        begun, calls = (time.perf_counter(), time.process_time()), 0
        while (spent := time.perf_counter() - begun[0]) < seconds / 5:
            step()
            calls += 1
        for kind, taken in enumerate((spent, time.process_time() - begun[1])):
            best[kind] = max(best[kind], calls * actions_a_step / max(taken, 1e-9))
    return best


def row(*cells):
    print("| " + " | ".join(str(cell) for cell in cells) + " |", flush=True)


def shown(rates):
    """Rates as cells of a row."""
    return [f"{actions:,.0f}" for actions in rates]


def bench(work, threads):
    """Actions per second of a work item of the Rust benchmark."""
    command = ["cargo", "bench", "--quiet", "--bench", "work", "--", "--only", work, "--threads", str(threads)]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    return next(1e3 / found["ms"] for found in map(json.loads, lines) if found["work"] == work)


def random_actions(envs, seconds, batches=64):
    """Steps with actions drawn in advance, so that Gymnasium's sampling is not measured."""
    envs.reset(seed=0)
    envs.action_space.seed(0)
    actions = [envs.action_space.sample() for _ in range(batches)]
    turn = iter(range(10**9))
    return rate(lambda: envs.step(actions[next(turn) % batches]), envs.num_envs, seconds)


def part_random(options):
    for task in ("task1", "task5"):
        for number in (1, 64, 1024):
            for threads in dict.fromkeys((1, os.cpu_count())):
                envs = mge.PuzzleVectorEnv(task, number, num_threads=threads)
                row(f"`make_vec`, {task}, {number} environments", f"{threads} threads", *shown(random_actions(envs, options.seconds)))
        envs = mge.PuzzleVectorEnv(task, 1024, num_threads=1, copy=False)
        row(f"`make_vec`, {task}, 1024 environments, without copies", "1 threads", *shown(random_actions(envs, options.seconds)))
    for level in ("Push", "Seesaw"):
        for threads in dict.fromkeys((1, os.cpu_count())):
            envs = mge.PuzzleVectorEnv(f"create/{level}", 1024, num_threads=threads, tools="train")
            row(f"`make_vec`, create/{level} with tools, 1024 environments", f"{threads} threads", *shown(random_actions(envs, options.seconds)))
    env = gymnasium.make("mge/task5-v0").unwrapped
    env.reset(seed=0)
    action = env.action_space.sample()

    def step():
        if any(env.step(action)[2:4]):
            env.reset()

    row("`make`, task5", "1 threads", *shown(rate(step, 1, options.seconds)))
    sync = gymnasium.vector.SyncVectorEnv([lambda: mge.PuzzleEnv("task5")] * 64)
    row("Gymnasium's `SyncVectorEnv` of 64 `PuzzleEnv`, task5", "1 threads", *shown(random_actions(sync, options.seconds)))


def part_rust(options):
    """1024 environments through `step`; and `env_action` of `benches/work`: a single environment of task5 under random
    play, including resets."""
    for threads in dict.fromkeys((1, os.cpu_count())):
        envs = mge.PuzzleVectorEnv("task5", 1024, num_threads=threads)
        envs.reset(seed=0)
        actions = np.random.default_rng(0).uniform(-1, 1, (32, 1024, 2)).astype(np.float32)
        ours = []
        for _ in range(max(3, int(options.seconds * 5))):
            start = time.perf_counter(), time.process_time()
            for batch in actions:
                envs.step(batch)
            ours.append((time.perf_counter() - start[0], time.process_time() - start[1]))
        best = [actions.size / 2 / min(taken) for taken in zip(*ours, strict=True)]
        row("1024 environments of task5", f"{threads} threads", *shown(best))
        if shutil.which("cargo"):
            row("one environment of task5, Rust alone", f"{threads} threads", *shown([bench("env_action", threads)]), "")


def part_others(options):
    sync = gymnasium.make_vec("Pendulum-v1", num_envs=64, vectorization_mode="sync")
    row("Gymnasium's `SyncVectorEnv`, Pendulum-v1, 64 environments", "1 threads", *shown(random_actions(sync, options.seconds)))
    ready = gymnasium.make_vec("CartPole-v1", num_envs=1024, vectorization_mode="vector_entry_point")
    row("Gymnasium's vector CartPole-v1 (NumPy), 1024 environments", "1 threads", *shown(random_actions(ready, options.seconds)))
    if importlib.util.find_spec("envpool") is None:
        return row("EnvPool", "skipped: not installed", "", "")
    import envpool

    for name in ("Pendulum-v1", "BipedalWalker-v3", "LunarLanderContinuous-v2"):
        for threads in dict.fromkeys((1, os.cpu_count())):
            try:
                envs = envpool.make(name, env_type="gymnasium", num_envs=1024, num_threads=threads, seed=0)
                shape = (1024, *envs.action_space.shape)
                actions = np.random.default_rng(0).uniform(-1, 1, shape).astype(envs.action_space.dtype)
                envs.reset()
                row(f"EnvPool, {name}, 1024 environments", f"{threads} threads", *shown(rate(lambda: envs.step(actions), 1024, options.seconds)))
            except Exception as error:
                row(f"EnvPool, {name}", f"skipped: {str(error).splitlines()[0][:80]}", "", "")


def part_create(options):
    """CREATE's levels with its own action sets, including resets, with and without drawing images; our
    environments, through Python and, with cargo, in Rust alone. Alternates level by level."""
    if options.create is None:
        return row("CREATE", "skipped: give a clone of its repository with `--create`", "", "")
    os.environ["SDL_VIDEODRIVER"] = "dummy"
    sys.path.insert(0, options.create)
    for name, kind in (("bool", bool), ("float", float), ("int", int)):
        # Aliases that newer NumPy versions have removed.
        if name not in vars(np):
            setattr(np, name, kind)
    import create_game  # registers its levels
    import gym

    for name in mge.level_names():
        level = f"create/{name}"
        for what, image in (("with images", True), ("without", False)):
            theirs = gym.make(f"CreateLevel{name}-v0").unwrapped
            theirs.set_settings(create_game.settings.CreateGameSettings())
            if not image:
                theirs.render = lambda *_, **__: None
            # CREATE's own check refuses all float64 places, but it cannot draw tools at float32 ones.
            theirs.check_out_of_range = lambda place: False
            random = np.random.default_rng(0)
            theirs.reset()

            def step(env=theirs, random=random):
                if env.step([random.integers(0, 40), *random.uniform(-1, 1, 2)])[2]:
                    env.reset()

            row(f"CREATE's {name}, {what}", "1 threads", *shown(rate(step, 1, options.seconds)))
        envs = mge.PuzzleVectorEnv(level, 64, num_threads=1, tools="train")
        row(f"`make_vec`, {level}, 64 environments", "1 threads", *shown(random_actions(envs, options.seconds)))
        if shutil.which("cargo"):
            row(f"{level}, Rust alone", "1 threads", *shown([bench(f"level_{name}", 1)]), "")


class Toy(gymnasium.Env):
    """A minimal stand-in for a puzzle in pure Python: our spaces and observations, a ball that falls
    for 40 steps per action, no contacts but the floor. Placed tools appear in the observation, because the time
    of learning depends on the number of zeros and should equal that on our tasks."""

    def __init__(self):
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (162,), np.float32)
        self.action_space = gymnasium.spaces.Box(-1, 1, (2,), np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.ball, self.count, self.seen = [0.0, 0.8, 0.0, 0.0], 0, np.zeros(162, np.float32)
        self.seen[[4, 160]] = 1  # the ball's type, and the next stage
        return self.observation(), {}

    def observation(self):
        self.seen[:4] = self.ball
        return self.seen.copy()

    def step(self, action):
        x, y, vx, vy = self.ball
        vx += 0.1 * float(action[0])
        for _ in range(40):
            vy -= 0.3 / 30
            x += vx / 30
            y += vy / 30
            if y < -1:
                y, vy = -2 - y, -0.5 * vy
        self.ball, self.count = [x, y, vx, vy], self.count + 1
        tool = self.seen[10 * self.count :]
        tool[2:4], tool[5] = action, 1
        return self.observation(), -abs(x), False, self.count >= 12, {}


def part_trainers(options):
    if importlib.util.find_spec("stable_baselines3") is None:
        return row("Stable-Baselines3", "skipped: not installed", "", "")
    import stable_baselines3
    import torch
    from mge.sb3 import PuzzleVecEnv
    from stable_baselines3.common.vec_env import DummyVecEnv

    torch.set_num_threads(1)
    alone = {"learning_starts": 1000, "gradient_steps": 1}
    many = {"n_steps": 64, "batch_size": 512}
    agents = {"Stable-Baselines3, TD3": (stable_baselines3.TD3, 16, alone), "Stable-Baselines3, PPO": (stable_baselines3.PPO, 64, many)}
    if importlib.util.find_spec("sbx") is not None:
        import sbx

        agents |= {"SBX, SAC": (sbx.SAC, 16, alone), "SBX, PPO": (sbx.PPO, 64, many)}
    for name, (agent, number, settings) in agents.items():
        toy, ours = DummyVecEnv([Toy] * number), PuzzleVecEnv("task1", number, num_threads=1)
        models = [agent("MlpPolicy", envs, policy_kwargs={"net_arch": [64, 64]}, seed=0, **settings) for envs in (toy, ours)]
        for model in models:
            model.learn(2 * 4096)  # compilation and cache warm-up
        # Short alternating turns, so that other work disturbs both alike; CPU time.
        spent = np.array([[learning_time(model) for model in models] for _ in range(options.rounds)])
        inside = np.array([[environment_time(envs) for envs in (toy, ours)] for _ in range(options.rounds)])
        mean, saved = spent.mean(axis=0), spent[:, 0] - spent[:, 1]
        error = 1.96 * saved.std() / len(saved) ** 0.5
        row(
            f"{name}, {number} environments, 20,000 steps: toy in pure Python, task1",
            f"{mean[0]:.2f}, {mean[1]:.2f} CPU seconds",
            f"{saved.mean():.2f} ± {error:.2f} s saved",
            "of which in the environments {:.2f}, {:.2f} s".format(*np.median(inside, axis=0)),
        )


def learning_time(model, steps=4096):
    """CPU time of 20,000 training steps, extrapolated from `steps`."""
    start = time.process_time()
    model.learn(steps, reset_num_timesteps=False)
    return (time.process_time() - start) * 20_000 / steps


def environment_time(envs, steps=4096):
    """CPU time of 20,000 steps in a vector of environments, extrapolated from `steps`."""
    envs.reset()
    actions = np.zeros((envs.num_envs, 2), np.float32)
    start = time.process_time()
    for _ in range(steps // envs.num_envs):
        envs.step(actions)
    return (time.process_time() - start) * 20_000 / steps


def part_memory(options):
    """Resident memory after the first and after ten million steps."""
    envs = mge.PuzzleVectorEnv(num_envs=1024)
    envs.reset(seed=0)
    actions = [envs.action_space.sample() for _ in range(64)]
    steps = options.steps
    for number in range(steps // 1024 + 1):
        envs.step(actions[number % 64])
        if number == steps // 10240:
            first = resident()
    row(f"Memory after {steps / 10:,.0f} and {steps:,} steps", f"{first:.1f} MB", f"{resident():.1f} MB", "")


def resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * resource.getpagesize() / 1e6


PARTS = {"random": part_random, "rust": part_rust, "create": part_create, "others": part_others, "trainers": part_trainers, "memory": part_memory}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], help="default: all")
    parser.add_argument("--create", metavar="FOLDER", help="a clone of CREATE's repository")
    parser.add_argument("--seconds", type=float, default=3.0, help="per measurement")
    parser.add_argument("--rounds", type=int, default=50, help="alternating rounds of the trainers")
    parser.add_argument("--steps", type=int, default=10_000_000, help="steps of the memory measurement")
    options = parser.parse_args()
    row("what", "how", "actions per second", "per CPU second")
    row("---", "---", "--:", "--:")
    for name in options.parts or PARTS:
        PARTS[name](options)


if __name__ == "__main__":
    main()
