"""The figures of MGE Workbench. Each is a `Figure`: displayed by notebooks, written by `save`."""

from __future__ import annotations

import os
from collections.abc import Sequence

from mge import _mge
from mge._mge import ActionPrior, Figure, State, Task

__all__ = ["Figure", "clusters", "learning_curves", "methods", "scene", "tasks"]

Folders = str | os.PathLike[str] | Sequence[str | os.PathLike[str]]


def folder_list(folders: Folders) -> list[str]:
    """One folder or several, as a list."""
    if isinstance(folders, (str, os.PathLike)):
        return [os.fspath(folders)]
    return [os.fspath(folder) for folder in folders]


def tasks(*tasks: Task | str | os.PathLike[str]) -> Figure:
    """Tasks side by side: each a `Task`, the name of a shipped one, or the path of a task file."""
    return _mge.figure_tasks(list(tasks))


def scene(state: State) -> Figure:
    """The scene of a state, or of the first of several."""
    return state.figure()


def clusters(task: Task | str | os.PathLike[str], prior: ActionPrior, seed: int = 0) -> Figure:
    """Actions drawn from the clusters of each stage of a task."""
    return _mge.figure_clusters(task, prior, seed)


def learning_curves(folders: Folders, greedy: bool = False, steps: bool = False) -> Figure:
    """Success of runs, interquartile mean over seeds with its interval: in training against episodes or, with
    `steps`, against charged actions; or of the greedy policy."""
    return _mge.figure_learning(folder_list(folders), greedy, steps)


def methods(folders: Folders) -> Figure:
    """Area under the learning curve of every method, by task."""
    return _mge.figure_methods(folder_list(folders))
