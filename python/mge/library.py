"""Rollouts of dynamics models, as arrays."""

from __future__ import annotations

import os
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from mge import _mge
from mge._mge import Model, State, Task


class DynamicsModel(Protocol):
    """The interface of a custom dynamics model, accepted wherever a `Model` is.

    Attributes:
        interval: physics steps (1/30 s) per prediction; must divide the 40 of an action.
    """

    interval: int

    def advance(self, balls: np.ndarray, tools: np.ndarray) -> np.ndarray:
        """Predicts the balls one interval later.

        Args:
            balls: float32, n x 5: x, y (normalised), velocity x, y (units/s; the screen is 84 units
                wide), spin (radians/s).
            tools: float32, n x m x 8: type (index in `mge.tool_types()`), x, y (normalised), size,
                angle, radius, elasticity, friction; NaN where a scene has fewer tools.

        Returns:
            An array like `balls`.
        """
        ...


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
    model: Model | DynamicsModel | str | os.PathLike[str],
    actions: npt.ArrayLike,
    start: State | None = None,
) -> Rollouts:
    """Rolls out sequences of actions in one batch.

    Args:
        task: a `Task`, the name of a shipped one, or the path of a task file.
        model: a `Model`, `"physics"`, `"rapier"` (another engine), the name or path of a model, or a
            custom one.
        actions: n x length x 2, normalised places of tools.
        start: one state for all sequences or one for each; None for the start of the task.
    """
    return Rollouts(**_mge.rollout(task, model, actions, start))
