"""Checks that the real TensorBoard reads the same values from a run as its own log holds.

    pip install tensorboard
    python tests/python/check_tensorboard.py RUN...

Reads tensorboard/ of each run through TensorBoard's own event accumulator and compares every
value with metrics.csv and events.jsonl, as 32-bit floats. Exit status 1 at the first difference.
"""

import csv
import json
import sys
from pathlib import Path

import numpy as np
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.plugins.hparams.plugin_data_pb2 import HParamsPluginData

COLUMNS = {
    "train/return": "return",
    "train/success_rolling": "rolling_success",
    "train/goal": "goal",
    "train/subgoals": "subgoals",
    "train/steps": "steps",
    "train/environment_steps": "environment_steps",
    "train/guided": "guided",
    "train/epsilon": "epsilon",
    "train/noise_sigma": "noise_sigma",
    "train/blocked": "blocked",
    "train/mean_q": "mean_q",
    "train/max_q": "max_q",
    "train/action_saturation": "action_saturation",
    "loss/critic": "critic_loss",
    "loss/actor": "actor_loss",
}


def number(text):
    return np.float32({"true": 1, "false": 0}.get(text, text))


def expected(run):
    """Tag -> [(step, value)], from the run's own files."""
    series = {}
    with open(run / "metrics.csv", newline="") as file:
        for row in csv.DictReader(file):
            for tag, column in COLUMNS.items():
                if row[column] != "":
                    series.setdefault(tag, []).append((int(row["episode"]), number(row[column])))
    for line in (run / "events.jsonl").read_text().splitlines():
        event = json.loads(line)
        if event["type"] == "evaluated":
            for name in ("success", "mean_return"):
                point = (event["episode"], number(event[name]))
                series.setdefault(f"eval/{name}", []).append(point)
    return series


def check(run):
    accumulator = EventAccumulator(str(run / "tensorboard"), size_guidance={"scalars": 0})
    accumulator.Reload()
    tags = accumulator.Tags()
    own = expected(run)
    shown = {tag for tag in tags["scalars"] if not tag.startswith("time/")}
    assert shown == set(own), f"tags differ: {shown ^ set(own)}"
    for tag, points in own.items():
        found = accumulator.Scalars(tag)
        steps = [point.step for point in found]
        assert steps == [step for step, _ in points], f"{tag}: steps {steps}"
        values = np.array([point.value for point in found], dtype=np.float32)
        np.testing.assert_array_equal(values, [value for _, value in points], err_msg=tag)
    assert "time/seconds" in tags["scalars"], "time/seconds is missing"
    groups = {tag.split("/")[0] for tag in tags["scalars"]}
    assert groups == {"train", "loss", "eval", "time"}, f"groups of tags: {groups}"
    plugin = accumulator.SummaryMetadata("_hparams_/session_start_info").plugin_data
    hparams = HParamsPluginData.FromString(plugin.content).session_start_info.hparams
    settings = json.loads((run / "config.json").read_text())["config"]
    assert hparams["seed"].number_value == settings["seed"] and hparams["method"].string_value == settings["method"]
    assert hparams["task.name"].string_value == settings["task"]["name"], "hyperparameters differ"
    print(f"{run}: {len(own)} tags, {sum(map(len, own.values()))} values agree")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    for argument in sys.argv[1:]:
        check(Path(argument))
