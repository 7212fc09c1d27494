"""Training: `train` and `resume`."""

from __future__ import annotations

import json
import os
import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

from mge import _mge
from mge._mge import Task
from mge.results import Run, read_run

LINE_EVERY = 60.0  # seconds between two lines of progress that is not on a terminal


def train(
    task: Task | str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    callback: Callable[[dict[str, Any]], object] | None = None,
    progress: bool = True,
    config: str | os.PathLike[str] | None = None,
    **settings: Any,
) -> Run:
    """Trains an agent, like `mge train`, and returns its run.

    The training runs on a thread of its own in Rust. Ctrl-C and exceptions of the callback end it with a
    checkpoint, from which `resume` continues.

    Args:
        task: a `Task`, the name of a shipped one, or the path of a task file.
        out: the run's folder, which must be new; None for a new one in `runs`.
        callback: called with each event of the run's log, such as `{"type": "episode_finished", "episode": 1,
            "rolling_success": 0.0, ...}`. The training does not wait for it.
        progress: whether to show progress on stderr.
        config: a file of settings, or the name of a shipped one: `paper`, `paper-literal`, `adaptive`.
        settings: those of a run: `method`, `seed`, `episodes`, `epsilon`, `start_noise`, `model` (`"trained"`,
            `"learned"`, `"true"`, `"rapier"`, `"uniform"` or a file) and so on; groups as `ddpg={"gamma": 0.9}`.
    """
    return read_run(_mge.train(task, out, config, settings, _teller(callback, progress)))


def resume(
    run: str | os.PathLike[str],
    episodes: int | None = None,
    *,
    callback: Callable[[dict[str, Any]], object] | None = None,
    progress: bool = True,
) -> Run:
    """Continues the run in a folder from its newest checkpoint, like `mge resume`, and returns it.

    Args:
        run: the run's folder. A finished run is left as it is.
        episodes: a new number of episodes, for a run that has fewer.
        callback, progress: as in `train`.
    """
    return read_run(_mge.resume(run, episodes, _teller(callback, progress)))


def _teller(callback: Callable[[dict[str, Any]], object] | None, progress: bool) -> Callable[[str, str], None]:
    """What Rust calls with the kind and the text of each piece of news."""
    shown = -LINE_EVERY
    episodes = "?"

    def show(text: str, is_last: bool = False) -> None:
        nonlocal shown
        if not progress:
            return
        if sys.stderr.isatty():
            sys.stderr.write(f"\r{text}\x1b[K" + "\n" * is_last)
        elif is_last or time.monotonic() - shown >= LINE_EVERY:
            sys.stderr.write(text + "\n")
            shown = time.monotonic()
        sys.stderr.flush()

    def tell(kind: str, text: str) -> None:
        nonlocal episodes
        if kind == "warning":
            warnings.warn(text, stacklevel=3)
        elif kind == "phase":
            show(text)
        else:
            event = json.loads(text)
            if event["type"] == "started":
                episodes = event["episodes"]
            elif event["type"] == "episode_finished":
                done, success = event["episode"], event["rolling_success"]
                show(f"{done}/{episodes} episodes, success {success:.0%}", is_last=done == episodes)
            if callback is not None:
                callback(event)

    return tell
