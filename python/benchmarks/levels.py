"""Table of a sweep over CREATE's levels: a row for each level, the columns of each method side by side.

    python python/benchmarks/levels.py sweeps/create

For random play (epsilon 1, no updates) the goals in all training episodes; for the other methods these, and the mean
success and return of the policy alone in the last evaluation. Prints Markdown.
"""

import argparse
from collections import defaultdict
from pathlib import Path

import mge


def method(config):
    """The name of a run's method, with its refinement; None for random play."""
    if config["method"] == "ddpg-uniform":
        return None
    return config["method"] + (", refined" if config["refinement"]["every"] else "")


def cells(runs):
    """Goals of all episodes, and means over the seeds of the last evaluation."""
    goals = sum(int(run.episodes["goal"].sum()) for run in runs)
    episodes = sum(len(run.episodes["goal"]) for run in runs)
    latest = [run.evaluations for run in runs if len(run.evaluations["episode"])]
    means = [sum(each[name][-1] for each in latest) / len(latest) for name in ("success", "mean_return") if latest]
    return [f"{goals} of {episodes}", *(f"{mean:.2f}" for mean in means)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path, help="folders of sweeps")
    options = parser.parse_args()
    groups = defaultdict(list)
    for folder in options.folders:
        for path in sorted((folder / "runs").iterdir()):
            run = mge.read_run(path)
            if run.state == "finished":
                groups[run.config["task"]["name"], method(run.config)].append(run)
    levels, methods = sorted({level for level, _ in groups}), sorted({name for _, name in groups if name})
    heads = "".join(f" {name}: goals | success | return |" for name in methods)
    print(f"| level | random play: goals |{heads}")
    print("|---|--:|" + "--:|--:|--:|" * len(methods))
    for level in levels:
        row = [level, *cells(groups[level, None])[:1]] if (level, None) in groups else [level, "-"]
        for name in methods:
            row += cells(groups[level, name]) if (level, name) in groups else ["-"] * 3
        print("| " + " | ".join(map(str, row)) + " |")


if __name__ == "__main__":
    main()
