"""What rliable makes of the runs in a report: `rliable_numbers.py REPORT.json [RESAMPLES]`.

Writes JSON to stdout: for each measure the scores of every method (task by task), rliable's
aggregates of them as [value, low, high], and for the area under the
curve over charged actions the probability of improvement of each method over each other. `tests/data/rliable/` holds
such an answer, for the runs of a real study (`mge reproduce`, then `mge report`).
"""

import json
import sys

import numpy as np
from rliable import library, metrics

MEASURES = ["charged_area", "auc", "final_success", "held_success"]
AGGREGATES = {
    "iqm": metrics.aggregate_iqm,
    "mean": metrics.aggregate_mean,
    "median": metrics.aggregate_median,
    "optimality_gap": metrics.aggregate_optimality_gap,
}


def interval(scores, function, resamples):
    """A number with its stratified bootstrap interval."""
    random = np.random.RandomState(0)
    values, ends = library.get_interval_estimates(
        {"it": scores}, function, reps=resamples, random_state=random
    )
    return [float(values["it"]), float(ends["it"][0, 0]), float(ends["it"][1, 0])]


def numbers(report, resamples):
    """rliable's numbers for every method of a report, and the scores behind them."""
    labels = list(dict.fromkeys(row["method"] for row in report["aggregates"]))
    answer = {"resamples": resamples, "measures": {}}
    for measure in MEASURES:
        methods = {}
        for row in report["aggregates"]:
            if row["measure"] != measure:
                continue
            scores = np.array(row["scores"]).T  # rliable wants runs x tasks
            found = {name: interval(scores, function, resamples) for name, function in AGGREGATES.items()}
            methods[row["method"]] = {"scores": row["scores"], **found}
        answer["measures"][measure] = methods
    # Reports of earlier versions have no charged actions.
    area = answer["measures"]["charged_area"] or answer["measures"]["auc"]
    answer["improvements"] = [
        [x, y, *improvement(np.array(area[x]["scores"]).T, np.array(area[y]["scores"]).T, resamples)]
        for x in labels
        for y in labels
        if x != y
    ]
    return answer


def improvement(x, y, resamples):
    """Probability that a run of `x` beats one of `y`, with its interval."""
    return interval((x, y), metrics.probability_of_improvement, resamples)


if __name__ == "__main__":
    with open(sys.argv[1]) as file:
        report = json.load(file)
    resamples = int(sys.argv[2]) if len(sys.argv) > 2 else 2000
    json.dump(numbers(report, resamples), sys.stdout, indent=1)
