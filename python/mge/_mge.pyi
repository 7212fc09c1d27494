"""The extension module: the library in Rust."""

import os
from collections.abc import Callable, Sequence
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "ActionPrior",
    "Actor",
    "Figure",
    "Model",
    "State",
    "Task",
    "VectorCore",
    "__version__",
    "build_prior",
    "figure_clusters",
    "figure_learning",
    "figure_methods",
    "figure_tasks",
    "level_names",
    "model_names",
    "read_results",
    "read_run",
    "resume",
    "rollout",
    "task_names",
    "tool_feature_names",
    "tool_features",
    "tool_numbers",
    "tool_types",
    "train",
    "whole",
    "words",
    "write_report",
]

__version__: str

_Path = str | os.PathLike[str]
_Task = Task | _Path
_Model = Model | _Path
_Float32 = NDArray[np.float32]

@final
class Task:
    """Task(name, **rules): a shipped task by its name, or the task in the file at that path, with other rules, such as
    `start_noise=0.1` or `rewards={"step": -0.1}`."""

    def __new__(cls, name: _Task, **rules: Any) -> Task: ...
    @staticmethod
    def parse(text: str, origin: str = "task") -> Task:
        """A task from its JSON text, in the format of task files."""

    def to_json(self) -> str:
        """The JSON text of the task file."""

    def save(self, path: _Path) -> None:
        """Writes the task file."""

    @property
    def name(self) -> str:
        """Short name."""

    @property
    def description(self) -> str:
        """A description in one sentence."""

    @property
    def max_actions(self) -> int:
        """Maximum number of actions per episode."""

    @property
    def observation_len(self) -> int:
        """Length of an observation."""

    @property
    def stages(self) -> _Float32:
        """Subgoals in order, then the goal: one row each of x, y (normalised) and radius (units)."""

@final
class State:
    """States of one or several environments: episodes and random streams. Returned by an environment's
    `get_state()`; can be pickled."""

    @staticmethod
    def parse(task: str, states: Sequence[str]) -> State: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> State: ...
    @property
    def balls(self) -> _Float32:
        """Balls, one row per state: x, y (normalised), velocity x, y (units/s), spin (radians/s)."""

    def figure(self) -> Figure:
        """The scene of the first state as a figure."""

@final
class VectorCore:
    """Environments of one task, with arrays that every reset and step overwrites."""

    def __new__(
        cls,
        task: _Task,
        num_envs: int,
        autoreset: str,
        num_threads: int | None = None,
        tools: str | None = None,
    ) -> VectorCore: ...
    @property
    def tool_count(self) -> int | None:
        """Number of tools an agent chooses among; None if it has only the task's own tool."""

    def bounds(self) -> tuple[_Float32, _Float32]:
        """Lower and upper bounds of an observation."""

    def parts(self) -> list[tuple[str, list[int]]]:
        """The parts of an observation in order: their names and shapes."""

    def reset(self, seeds: Sequence[int | None], mask: NDArray[np.bool_] | None = None) -> None:
        """Begins episodes in all environments or in the masked ones."""

    def step(self, places: _Float32, tools: NDArray[np.int64] | None = None) -> None:
        """Takes one action in each environment: a place and, where agents choose tools, the index of a tool."""

    def arrays(self) -> tuple[_Float32, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]:
        """The arrays of observations, rewards, terminations, truncations."""

    def facts(self) -> dict[str, NDArray[Any]]:
        """The arrays of facts, by name."""

    def ended(self) -> tuple[NDArray[np.int64], _Float32, dict[str, NDArray[Any]]] | None:
        """The episodes that the latest step ended and replaced (autoreset): their environments, last
        observations, and facts. None if there are none."""

    def state(self, indices: Sequence[int]) -> State:
        """The states of these environments."""

    def restore(self, indices: Sequence[int], state: State) -> None:
        """Puts these environments into these states, or all into a single state."""

    def render(self, index: int, width: int, height: int) -> NDArray[np.uint8]:
        """The scene of an environment as rows of pixels, height x width x 3."""

@final
class Model:
    """Model(name): a shipped dynamics model by its name, or the one in the file at that path."""

    def __new__(cls, name: _Path) -> Model: ...
    @staticmethod
    def from_bytes(file: bytes) -> Model:
        """The model in the bytes of a model file."""

    @staticmethod
    def shipped_for(task: _Task) -> Model:
        """The shipped model for the tools of a task."""

    @property
    def name(self) -> str:
        """The names of its tools, joined by hyphens."""

    @property
    def tools(self) -> list[str]:
        """The tool types it was trained on."""

    @property
    def interval(self) -> int:
        """Physics steps (1/30 s) from one prediction to the next."""

    @property
    def provenance(self) -> str:
        """How it was trained, as JSON."""

    def predict(self, task: _Task, balls: ArrayLike, placed: ArrayLike | None = None, steps: int = 1) -> _Float32:
        """Predicts the balls `steps` prediction intervals later, among the tools of a task and those placed.

        Args:
            balls: n x 5: x, y (normalised), velocity x, y (units/s), spin (radians/s).
            placed: n x m x 2, normalised places of further tools; rows with NaN are ignored.
        """

@final
class ActionPrior:
    """Clusters of rewarding actions for every stage of a task: the distributions from which guided
    exploration samples."""

    @staticmethod
    def parse(text: str, task: _Task, origin: str = "prior") -> ActionPrior:
        """The prior from the text of a `prior.json`."""

    @staticmethod
    def of_run(path: _Path) -> ActionPrior:
        """The prior that a run used last."""

    def to_json(self) -> str:
        """The JSON text, as in a run's `prior.json`."""

    @property
    def task(self) -> str:
        """Name of the task."""

    @property
    def model(self) -> str:
        """Name of the model that predicted the rollouts."""

    def __len__(self) -> int: ...
    def clusters(self, stage: int) -> dict[str, NDArray[Any]]:
        """The clusters of a stage, the largest first: `mean` and `std` (k x 2), `weight` and `count` (k)."""

    def sample(self, stage: int, count: int, seed: int) -> _Float32:
        """Samples actions for a stage, count x 2; uniformly if the stage has no clusters."""

@final
class Actor:
    """Actor(run): the actor in the newest checkpoint of a run."""

    def __new__(cls, run: _Path) -> Actor: ...
    def act(self, observations: ArrayLike) -> _Float32:
        """The actions for observations: n x 2 for n x length."""

    def values(self, observations: ArrayLike, actions: ArrayLike) -> _Float32:
        """The critic's values of pairs of observations and actions."""

@final
class Figure:
    """A figure: displayed by notebooks, written by `save`."""

    def svg(self) -> str:
        """The figure as SVG."""

    def csv(self) -> str:
        """The figure's data as CSV."""

    def save(self, path: _Path, dpi: int | None = None) -> None:
        """Writes the figure in the format of the path's extension (.png, .svg), and its data
        beside it as CSV."""

def task_names() -> list[str]:
    """Names of the shipped tasks."""

def level_names() -> list[str]:
    """Names of CREATE's levels: `create/NAME` is a task, `create/NAME-random` its random variant."""

def tool_numbers(split: str = "all") -> NDArray[np.int64]:
    """Numbers of the tools in a split of CREATE's catalogue, without the no-op: `"all"`, `"train"`,
    `"validation"` or `"test"`."""

def tool_features(numbers: Sequence[int]) -> _Float32:
    """Features of tools of the catalogue, one row per number: one-hot of the type, then properties.
    The no-op is all zeros."""

def tool_feature_names() -> list[str]:
    """Names of the columns of `tool_features`."""

def model_names() -> list[str]:
    """Names of the shipped models."""

def tool_types() -> list[str]:
    """Names of the tool types, indexed by their number in observations."""

def whole(value: Any, name: str, least: int, most: int) -> int:
    """A whole number from `least` to `most`; `name` is that of the argument in errors."""

def words() -> list[list[str | None]]:
    """The names of the codes of `placement` and `end`; None for code 0."""

def build_prior(task: _Task, model: _Model, seed: int = 0, **settings: Any) -> ActionPrior:
    """Builds the action prior of a task from rollouts in a model.

    Args:
        model: a `Model`, `"physics"`, `"rapier"`, or the name or path of a model.
        settings: those of `guidance` that differ from their defaults, such as `model_rollouts=1000`.
    """

def rollout(
    task: _Task, model: _Model, actions: ArrayLike, start: State | None = None
) -> dict[str, NDArray[Any]]: ...
def read_run(path: _Path) -> str: ...
def train(
    task: _Task,
    out: _Path | None,
    config: _Path | None,
    settings: dict[str, Any],
    tell: Callable[[str, str], object],
) -> _Path: ...
def resume(run: _Path, episodes: int | None, tell: Callable[[str, str], object]) -> _Path: ...
def read_results(folders: Sequence[_Path]) -> str: ...
def write_report(
    folders: Sequence[_Path],
    out: _Path,
    resamples: int = 2000,
    confidence: float = 0.95,
    seed: int = 0,
    dpi: int | None = None,
) -> str: ...
def figure_tasks(tasks: Sequence[_Task]) -> Figure: ...
def figure_learning(folders: Sequence[_Path], greedy: bool = False, steps: bool = False) -> Figure: ...
def figure_methods(folders: Sequence[_Path]) -> Figure: ...
def figure_clusters(task: _Task, prior: ActionPrior, seed: int = 0) -> Figure: ...
