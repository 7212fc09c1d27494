"""Predictions and rollouts of dynamics models, as arrays."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

from mge import _mge
from mge._mge import Model, State, Task


class DynamicsModel(Protocol):
    """What a dynamics model of your own has, to be used wherever a `Model` is.

    Attributes:
        interval: physics steps (1/30 s) of one prediction; divides the 40 of an action.
    """

    interval: int

    def advance(self, balls: np.ndarray, tools: np.ndarray) -> np.ndarray:
        """The balls one interval later.

        Args:
            balls: float32, n x 5: x, y (normalised), velocity x, y (units/s; the screen is 84 units
                wide), spin (radians/s).
            tools: float32, n x m x 8: type (place in `mge.tool_types()`), x, y (normalised), size,
                angle, radius, elasticity, friction; NaN where a scene has fewer tools.

        Returns:
            An array like `balls`.
        """
        ...


class Rollouts(NamedTuple):
    """What becomes of the ball under n sequences of actions.

    Attributes:
        hit: n; whether the next stage of the start is reached, in the last action taken.
        length: n; actions taken until the end of the rollout.
        placed: n x length; whether each action's tool was placed.
        touched: n x length; whether the ball touched that tool before the stage was reached.
        path: n x points x 2; normalised positions of the ball, one a prediction, then NaN.
        balls: n x length x 5; the ball after each action (x, y, velocity x, y, spin), then NaN.
    """

    hit: np.ndarray
    length: np.ndarray
    placed: np.ndarray
    touched: np.ndarray
    path: np.ndarray
    balls: np.ndarray


def rollout(
    task: Task, model: Model | DynamicsModel | str, actions: np.ndarray, start: State | None = None
) -> Rollouts:
    """Rolls out sequences of actions, all as one batch.

    Args:
        task: the task.
        model: a `Model`, `"physics"`, the name or path of a model, or one of your own.
        actions: n x length x 2, normalised places of tools.
        start: one state for all sequences or one for each; the start of the task without.
    """
    return Rollouts(**_mge.rollout(task, model, _array(actions, 3, "actions"), start))


def predict(
    model: Model, task: Task, balls: np.ndarray, placed: np.ndarray | None = None, steps: int = 1
) -> np.ndarray:
    """As `Model.predict`, from arrays of any number type."""
    places = None if placed is None else _array(placed, 3, "placed")
    return model.predict(task, _array(balls, 2, "balls"), places, steps)


def _array(values: Any, dimensions: int, name: str) -> np.ndarray:
    values = np.asarray(values)
    if values.ndim != dimensions or values.dtype.kind not in "fiu":
        raise ValueError(
            f"`{name}` is an array of {values.dtype} with the shape {values.shape}, "
            f"and should hold numbers in {dimensions} dimensions"
        )
    return np.ascontiguousarray(values, dtype=np.float32)
