"""Table of the agents of `peers.py`, and of runs of `mge train`, after a number of actions.

    python python/benchmarks/peers_table.py --actions 10000 peers/default peers/tuned --runs sweeps/peers

Prints Markdown: for each folder, agent and task the number of seeds, the mean (least to greatest) success over the latest
100 training episodes, the mean (least to greatest) success without exploration, the number of seeds in which the latter is
at least 0.8, and mean seconds of processor and of wall time. Runs of `mge train` count every action of episodes and of
practice; their evaluation is the latest one within that number of actions, and their wall time is that until then, with
the evaluations; their processor time is not known.
"""

import argparse
import csv
import json
import math
from collections import defaultdict
from pathlib import Path

import mge


def peer(path, actions):
    """The group of one table of `peers.py`, and its numbers after `actions`; None if it has not reached them."""
    with open(path, newline="") as file:
        row = next((row for row in csv.DictReader(file) if int(row["actions"]) == actions), None)
    if row is None:
        return None
    numbers = (float(row[name]) for name in ("success", "greedy", "cpu_seconds", "wall_seconds"))
    return (path.parent.name, row["algorithm"], row["task"]), tuple(numbers)


def ours(path, actions):
    """The same for a run of `mge train`, which uses one thread."""
    run = mge.read_run(path)
    events = [json.loads(line) for line in open(path / "events.jsonl")]
    within = run.episodes["environment_steps"] <= actions
    episode = run.episodes["episode"][within].max()
    evaluation = [event for event in events if event["type"] == "evaluated" and event["episode"] <= episode][-1]
    seconds = evaluation["time"] - events[0]["time"]
    numbers = (run.episodes["rolling_success"][within][-1], evaluation["success"], float("nan"), seconds)
    return (path.parents[1].name, run.config["method"], run.config["task"]["name"]), tuple(map(float, numbers))


def mean(values):
    number = sum(values) / len(values)
    return "" if math.isnan(number) else f"{number:.0f}"


def spread(values):
    return f"{sum(values) / len(values):.2f} ({min(values):.2f} to {max(values):.2f})"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="*", type=Path, help="folders of tables of peers.py")
    parser.add_argument("--runs", nargs="*", type=Path, default=[], help="folders of sweeps")
    parser.add_argument("--actions", type=int, default=10_000, help="number of actions (default 10000)")
    options = parser.parse_args()
    groups = defaultdict(list)
    for folder in options.folders:
        for path in sorted(folder.glob("*.csv")):
            if found := peer(path, options.actions):
                group, numbers = found
                groups[group].append(numbers)
    for folder in options.runs:
        for path in sorted((folder / "runs").iterdir()):
            group, numbers = ours(path, options.actions)
            groups[group].append(numbers)
    print("| task | agent | settings | seeds | training success | without exploration | at least 0.8 | processor | wall |")
    print("|---|---|---|--:|---|---|--:|--:|--:|")
    for (folder, agent, task), rows in sorted(groups.items(), key=lambda group: (group[0][2], group[0])):
        success, greedy, processor, wall = zip(*rows)
        solved = sum(value >= 0.8 for value in greedy)
        cells = [task, agent, folder, len(rows), spread(success), spread(greedy), solved, mean(processor), mean(wall)]
        print("| " + " | ".join(map(str, cells)) + " |")


if __name__ == "__main__":
    main()
