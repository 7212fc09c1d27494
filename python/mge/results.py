"""The data of runs, sweeps and reports as tables."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from mge import _mge
from mge.figures import Folders, folder_list


class Table(dict[str, Any]):
    """Columns by name: NumPy arrays of bool, int64 or float64 (NaN where a number is missing), or lists of texts.
    `pandas.DataFrame(table)` and `polars.DataFrame(table)` make frames of it."""

    def __repr__(self) -> str:
        rows = max((len(column) for column in self.values()), default=0)
        return f"<Table of {rows} rows and {len(self)} columns: {_few(self)}>"


class Run(NamedTuple):
    """A run on disk.

    Attributes:
        config: the complete configuration.
        state: `finished`, `running` and so on.
        episodes: one row for each episode, with the columns of `metrics.csv`.
        evaluations: one row for each greedy evaluation.
        path: its folder.
    """

    config: dict[str, Any]
    state: str
    episodes: Table
    evaluations: Table
    path: str

    def __repr__(self) -> str:
        episodes = len(next(iter(self.episodes.values()), ()))
        return f"<Run of {self.config['task']['name']}, {self.state}, {episodes} episodes>"


class Report(dict[str, Any]):
    """The content of a `report.json`."""

    def __repr__(self) -> str:
        return f"<Report: {_few(self)}>"


def _few(names: Iterable[str]) -> str:
    """The first few names of many."""
    names = list(names)
    return ", ".join(names[:4]) + (", ..." if len(names) > 4 else "")


_COMPACT = (",", ":")
_NUMBERS = {None: np.nan, "NaN": np.nan, "inf": np.inf, "-inf": -np.inf}


def _column(values: list[Any]) -> Any:
    """Values of a file as an array of bool, int64 or float64, else as a list of texts."""
    kinds = set(map(type, values))
    if kinds == {bool} or (kinds == {int} and all(-(2**63) <= value < 2**63 for value in values)):
        return np.array(values, bool if kinds == {bool} else np.int64)
    # Files have numbers that are not finite as texts.
    if all(type(value) in (int, float) or (not isinstance(value, (list, dict)) and value in _NUMBERS) for value in values):
        return np.array([value if type(value) in (int, float) else _NUMBERS[value] for value in values], np.float64)
    return [value if value is None or isinstance(value, str) else json.dumps(value, separators=_COMPACT) for value in values]


def _table(rows: list[dict[str, Any]], example: dict[str, Any] | None = None) -> Table:
    """Rows as columns, in order of first appearance; without rows, empty columns of the kinds that the example has."""
    if not rows and example is not None:
        return Table({name: _column([value])[:0] for name, value in example.items()})
    names = dict.fromkeys(name for row in rows for name in row)
    return Table({name: _column([row.get(name) for row in rows]) for name in names})


def read_run(path: str | os.PathLike[str]) -> Run:
    """Reads the run in a folder; it may still be training."""
    run = json.loads(_mge.read_run(path))
    episodes = _table(run["episodes"], run["episode"])
    evaluations = _table(run["evaluations"], run["evaluation"])
    return Run(run["config"], run["state"], episodes, evaluations, os.fspath(path))


def read_results(folders: Folders) -> Table:
    """Results of all runs in folders (runs, folders of runs, sweeps, studies): one row for each run, in
    which `episodes` are those done."""
    rows = []
    for run in json.loads(_mge.read_results(folder_list(folders))):
        measures = run.pop("measures")
        differing = {**measures.pop("settings", {}), **measures.pop("implied", {})}
        rows.append({**run, **differing, **measures})
    return _table(rows)


def write_report(
    folders: Folders,
    out: str | os.PathLike[str],
    resamples: int = 2000,
    confidence: float = 0.95,
    seed: int = 0,
    dpi: int | None = None,
) -> Report:
    """Writes a report of all finished runs in folders to `out`, like `mge report`, and returns the content of its
    `report.json`. If Ctrl-C interrupts it, the report may still be written in the background."""
    text = _mge.write_report(folder_list(folders), out, resamples, confidence, seed, dpi)
    return Report(json.loads(text))


def read_report(path: str | os.PathLike[str], part: str = "aggregates") -> Table:
    """A part of a report as a table: `aggregates`, `learning` or another list of its `report.json`.

    `path` is the folder of the report or its `report.json`.
    """
    file = os.path.join(path, "report.json") if os.path.isdir(path) else path
    try:
        with open(file, encoding="utf-8-sig") as text:
            report = dict(json.load(text))
    except (TypeError, ValueError) as error:
        raise ValueError(f"{os.fspath(file)} is not a report: {error}") from None
    rows = report.get(part)
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        lists = [name for name, value in report.items() if isinstance(value, list) and value and isinstance(value[0], dict)]
        raise ValueError(f"the report has no table `{part}`: use one of {', '.join(lists)}")
    return _table(rows)
