"""Rollouts of dynamics models, as arrays."""

from __future__ import annotations

import os
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mge import _mge
from mge._mge import Model, State, Task


class Rollouts(NamedTuple):
    """The outcome of n sequences of actions.

    Attributes:
        hit: n; whether the next stage after the start is reached (in the last action taken).
        length: n; number of actions taken until the end of the rollout.
        placed: n x length; whether each action's tool was placed.
        touched: n x length; whether the ball touched that tool before the stage was reached.
        path: n x points x 2; normalised positions of the ball, one per prediction, then NaN.
        balls: n x length x 5; the ball after each action (x, y, velocity x, y, spin), then NaN.
    """

    hit: np.ndarray
    length: np.ndarray
    placed: np.ndarray
    touched: np.ndarray
    path: np.ndarray
    balls: np.ndarray

    def __repr__(self) -> str:
        sequences, actions = self.placed.shape
        return f"<Rollouts of {sequences} sequences of up to {actions} actions, {self.hit.sum()} hits>"


def rollout(
    task: Task | str | os.PathLike[str],
    model: Model | str | os.PathLike[str],
    actions: npt.ArrayLike,
    start: State | None = None,
) -> Rollouts:
    """Rolls out sequences of actions in one batch.

    Args:
        task: a `Task`, the name of a shipped one, or the path of a task file.
        model: a `Model`, `"physics"`, `"rapier"` (another engine), or the name or path of a
            model.
        actions: n x length x 2, normalised places of tools.
        start: one state for all sequences or one for each; None for the start of the task.
    """
    return Rollouts(**_mge.rollout(task, model, actions, start))
