"""Plots success against actions: tables of `peers.py` together with runs of `mge train`. Needs matplotlib.

    python python/benchmarks/curves.py peers/task1-*.csv --runs runs/ddpg runs/ddpg-mge --out learning.png
"""

import argparse
import csv
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import mge


def peer(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    label = f"{rows[0]['algorithm']}, seed {rows[0]['seed']}"
    return label, [0, *(int(row["actions"]) for row in rows)], [0, *(float(row["success"]) for row in rows)]


def ours(path):
    run = mge.read_run(path)
    label = f"{run.config['method']}, seed {run.config['seed']} (ours)"
    return label, [0, *run.episodes["environment_steps"]], [0, *run.episodes["rolling_success"]]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tables", nargs="*", type=Path, help="tables of peers.py")
    parser.add_argument("--runs", nargs="*", type=Path, default=[], help="folders of runs")
    parser.add_argument("--out", type=Path, default=Path("learning.png"), help="png, svg or pdf (default learning.png)")
    options = parser.parse_args()
    figure, axes = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
    curves = [(*peer(path), "--") for path in options.tables] + [(*ours(path), "-") for path in options.runs]
    for label, actions, success, style in curves:
        axes.plot(actions, success, style, label=label, linewidth=1.4)
    axes.set(xlabel="actions", ylabel="success, latest 100 episodes", ylim=(-0.02, 1.02), xlim=(0, None))
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, fontsize="small")
    figure.savefig(options.out, dpi=150, metadata={"Software": None} if options.out.suffix == ".png" else {})


if __name__ == "__main__":
    main()
