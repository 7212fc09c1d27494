"""Number of episodes out of 1000 that reach the goal with all actions from clusters, for each model that predicted the
clusters: compares guidance by a dynamics model with guidance by the true physics.

    python python/benchmarks/guided.py --models old/ assets/models -- task1 task2 puzzle.json

A folder stands for the models in it: for every task, the first one that covers its tools is used.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from gymnasium.vector import AutoresetMode

import mge

SEEDS, EPISODES = 2, 500


def goals(task: mge.Task, prior: mge.ActionPrior, seed: int) -> int:
    """The number of episodes out of `EPISODES` that reach the goal."""
    env = mge.PuzzleVectorEnv(task, EPISODES, autoreset_mode=AutoresetMode.DISABLED)
    env.reset(seed=seed)
    shape = (task.max_actions, EPISODES, 2)
    # Drawn for every stage; each episode uses those of its current stage.
    drawn = np.stack([prior.sample(stage, shape[0] * shape[1], 100 * seed + stage) for stage in range(len(prior))])
    drawn = drawn.reshape(len(prior), *shape)
    stage = np.zeros(EPISODES, int)
    over, success = np.zeros(EPISODES, bool), np.zeros(EPISODES, bool)
    for step in range(task.max_actions):
        _, _, terminated, truncated, info = env.step(drawn[stage, step, np.arange(EPISODES)])
        success |= ~over & np.asarray(info["is_success"])
        reached = np.cumprod(np.asarray(info["subgoals"]), axis=1).sum(axis=1)
        stage = np.where(over, stage, np.minimum(reached, len(prior) - 1))
        ended = terminated | truncated
        over |= ended
        if over.all():
            break
        # An ended episode is reset and ignored from then on.
        env.reset(options={"reset_mask": ended}) if ended.any() else None
    env.close()
    return int(success.sum())


def prior(task: mge.Task, models: str, seed: int) -> mge.ActionPrior | None:
    """Clusters from the first model that covers the task's tools."""
    folder = Path(models)
    for model in sorted(folder.glob("*.safetensors")) if folder.is_dir() else [models]:
        try:
            return mge.build_prior(task, model if model == "physics" else mge.Model(model), seed)
        except ValueError:
            continue
    return None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--models", nargs="+", required=True, help="model files, or folders of them")
    parser.add_argument("tasks", nargs="+")
    arguments = parser.parse_args()
    columns = ["physics", *arguments.models]
    print("| task |", " | ".join(columns), "|")
    print("|---" * (len(columns) + 1) + "|")
    sums = dict.fromkeys(columns, 0)
    for name in arguments.tasks:
        task, cells = mge.Task(name), []
        for models in columns:
            priors = [prior(task, models, seed) for seed in range(SEEDS)]
            reached = [goals(task, known, seed) for seed, known in enumerate(priors) if known is not None]
            cells.append(str(sum(reached)) if reached else "-")
            sums[models] += sum(reached)
        print("|", task.name, "|", " | ".join(cells), "|", flush=True)
    print("| all |", " | ".join(str(total) for total in sums.values()), "|")


if __name__ == "__main__":
    main()
