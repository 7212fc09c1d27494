"""Trains an agent and logs its episodes and evaluations to Weights & Biases."""

import sys

import mge
import wandb

settings = {"seed": 0, "episodes": int(sys.argv[1]) if len(sys.argv) > 1 else 2000, "evaluation": {"every": 20}}
with wandb.init(project="mge", config=settings) as log:

    def callback(event):
        if event["type"] in ("episode_finished", "evaluated"):
            kind = "eval" if event["type"] == "evaluated" else "train"
            numbers = {f"{kind}/{name}": value for name, value in event.items() if isinstance(value, (int, float))}
            log.log(numbers, step=event["episode"])

    run = mge.train("task1", callback=callback, **settings)
print(f"final success {run.episodes['rolling_success'][-1]:.2f}: {run.path}")
