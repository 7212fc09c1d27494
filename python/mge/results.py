"""The data of runs, sweeps and reports as tables."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any, NamedTuple

from mge import _mge
from mge.figures import Folders, folder_list

if TYPE_CHECKING:
    import pandas
    import polars


class Table(dict[str, Any]):
    """Columns by name: NumPy arrays of bool, int64 or float64 (NaN where a number is missing), or lists."""

    def to_pandas(self) -> pandas.DataFrame:
        """The table as a pandas `DataFrame`; needs pandas."""
        import pandas

        return pandas.DataFrame(dict(self))

    def to_polars(self) -> polars.DataFrame:
        """The table as a polars `DataFrame`; needs polars."""
        import polars

        return polars.DataFrame(dict(self))


class Run(NamedTuple):
    """A run on disk.

    Attributes:
        config: the complete configuration.
        state: `finished`, `running` and so on.
        episodes: one row for each episode, with the columns of `metrics.csv`.
        evaluations: one row for each greedy evaluation.
    """

    config: dict[str, Any]
    state: str
    episodes: Table
    evaluations: Table


def read_run(path: str | os.PathLike[str]) -> Run:
    """Reads the run in a folder; it may still be training."""
    config, state, episodes, evaluations = _mge.read_run(path)
    return Run(json.loads(config), state, Table(episodes), Table(evaluations))


def read_results(folders: Folders) -> Table:
    """Results of all runs in folders (runs, folders of runs, sweeps, studies): one row for each run."""
    return Table(_mge.read_results(folder_list(folders)))


def write_report(
    folders: Folders,
    out: str | os.PathLike[str],
    resamples: int = 2000,
    confidence: float = 0.95,
    seed: int = 0,
    dpi: int | None = None,
) -> dict[str, Any]:
    """Writes a report of all finished runs in folders to `out`, like `mge report`, and returns the content of its
    `report.json`."""
    text = _mge.write_report(folder_list(folders), out, resamples, confidence, seed, dpi)
    return json.loads(text)


def read_report(path: str | os.PathLike[str], part: str = "aggregates") -> Table:
    """A part of a report as a table: `aggregates`, `learning` or another list of its `report.json`.

    `path` is the folder of the report or its `report.json`.
    """
    file = os.path.join(path, "report.json") if os.path.isdir(path) else path
    with open(file, encoding="utf-8") as text:
        report = json.load(text)
    rows = report.get(part)
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        lists = [name for name, value in report.items() if isinstance(value, list) and value and isinstance(value[0], dict)]
        raise ValueError(f"the report has no table `{part}`: use one of {', '.join(lists)}")
    names = list(dict.fromkeys(name for row in rows for name in row))
    return Table({name: [row.get(name) for row in rows] for name in names})
