"""The extension module: the library in Rust."""

import os
from collections.abc import Sequence
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mge.library import DynamicsModel, Rollouts

__version__: str

_Path = str | os.PathLike[str]
_Float32 = NDArray[np.float32]

@final
class Task:
    """Task(name): a shipped task by its name, or the task in the file at that path."""

    def __new__(cls, name: _Path) -> Task: ...
    @staticmethod
    def parse(text: str, origin: str = "task") -> Task:
        """A task from its JSON text, in the format of task files or that of CREATE's level files."""

    def to_json(self) -> str:
        """The JSON text of the task file."""

    def save(self, path: _Path) -> None:
        """Writes the task file."""

    @property
    def name(self) -> str:
        """Short name."""

    @property
    def description(self) -> str:
        """One sentence for people."""

    @property
    def max_actions(self) -> int:
        """Actions of an episode, at most."""

    @property
    def observation_len(self) -> int:
        """Length of an observation."""

    @property
    def observation_bounds(self) -> tuple[_Float32, _Float32]:
        """Least and greatest values of an observation."""

    @property
    def stages(self) -> _Float32:
        """Subgoals in order, then the goal: a row of x, y (normalised) and radius (units) each."""

@final
class State:
    """States of one or several environments: episodes and random numbers. Made by `get_state()` of
    an environment; can be pickled."""

    @staticmethod
    def parse(task: str, states: Sequence[str]) -> State: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> State: ...
    @property
    def balls(self) -> _Float32:
        """Balls, one row a state: x, y (normalised), velocity x, y (units/s), spin (radians/s)."""

    def figure(self) -> Figure:
        """The scene of the first state as a figure."""

@final
class VectorCore:
    """Environments of one task, with arrays that every reset and step writes anew."""

    def __new__(
        cls,
        task: Task,
        count: int,
        autoreset: str,
        threads: int | None = None,
        tools: str | None = None,
        images: bool = False,
        pictures: _Path | None = None,
    ) -> VectorCore: ...
    @property
    def tool_count(self) -> int | None:
        """Tools among which an agent chooses; None if it has the task's own tool."""

    def bounds(self) -> tuple[_Float32, _Float32]:
        """Least and greatest values of an observation."""

    def parts(self) -> list[tuple[str, list[int]]]:
        """The parts of an observation in order: their names and shapes."""

    def reset(self, seeds: Sequence[int | None], mask: NDArray[np.bool_] | None = None) -> None:
        """Begins episodes, in all environments or in those of the mask."""

    def step(self, places: _Float32, tools: NDArray[np.int64] | None = None) -> None:
        """One action in each environment: a place, and the index of a tool where agents choose."""

    def time_alone(self, actions: _Float32) -> float:
        """Seconds in which the library alone takes these actions, steps x count x 2: what `step` is
        measured against."""

    def arrays(self) -> tuple[_Float32, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]:
        """The arrays of observations, rewards, terminations, truncations."""

    def images(self) -> NDArray[np.uint8] | None:
        """The images of the scenes, count x 84 x 84 x 3; None if they are not wanted."""

    def facts(self) -> dict[str, NDArray[Any]]:
        """The arrays of facts, by name."""

    def ended(self) -> tuple[NDArray[np.int64], _Float32, NDArray[np.uint8] | None, dict[str, NDArray[Any]]] | None:
        """Of the episodes that the latest step ended and followed by the next: which environments,
        their last observations and images, the facts about them. None if there are none."""

    def state(self, indices: Sequence[int]) -> State:
        """The states of these environments."""

    def restore(self, indices: Sequence[int], state: State) -> None:
        """Puts these environments into these states, or all into a single one."""

    def render(self, index: int, width: int, height: int) -> NDArray[np.uint8]:
        """The scene of an environment as rows of pixels, height x width x 3."""

@final
class Model:
    """Model(name): a shipped dynamics model by its name, or the one in the file at that path."""

    def __new__(cls, name: _Path) -> Model: ...
    @staticmethod
    def shipped_for(task: Task) -> Model:
        """The shipped model that knows the tools of a task."""

    @property
    def name(self) -> str:
        """The names of its tools, joined by hyphens."""

    @property
    def tools(self) -> list[str]:
        """Tool types that it knows."""

    @property
    def interval(self) -> int:
        """Physics steps (1/30 s) from one prediction to the next."""

    @property
    def provenance(self) -> str:
        """Where it comes from, as JSON."""

    def predict(self, task: Task, balls: ArrayLike, placed: ArrayLike | None = None, steps: int = 1) -> _Float32:
        """The balls `steps` prediction intervals later, among the tools of a task and those placed.

        Args:
            balls: n x 5: x, y (normalised), velocity x, y (units/s), spin (radians/s).
            placed: n x m x 2, normalised places of further tools; rows with NaN are none.
        """

    def rollout(self, task: Task, actions: ArrayLike, start: State | None = None) -> Rollouts:
        """As `mge.rollout` with this model."""

@final
class ActionPrior:
    """Clusters of rewarding actions for every stage of a task: the distributions from which guided
    exploration samples."""

    @staticmethod
    def parse(text: str, task: Task, origin: str = "prior") -> ActionPrior:
        """The prior in the text of a `prior.json`."""

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
        """What predicted the rollouts."""

    def __len__(self) -> int: ...
    def clusters(self, stage: int) -> dict[str, NDArray[Any]]:
        """The clusters of a stage, the largest first: `mean` and `std` (k x 2), `weight` and `count` (k)."""

    def actions(self, stage: int) -> _Float32:
        """The rewarding actions that the clusters of a stage were made from, n x 2."""

    def rollouts(self, stage: int) -> tuple[int, int, int, int]:
        """Rollouts made for a stage and those that reached it: in the model, in the real environment."""

    def sample(self, stage: int, count: int, seed: int) -> _Float32:
        """Actions for a stage, count x 2. A stage without clusters samples uniformly."""

@final
class Actor:
    """Actor(run): the actor in the newest checkpoint of a run."""

    def __new__(cls, run: _Path) -> Actor: ...
    def act(self, observations: ArrayLike) -> _Float32:
        """The actions for observations: n x 2 for n x length."""

    def values(self, observations: ArrayLike, actions: ArrayLike) -> _Float32:
        """The values that the critic gives pairs of observations and actions."""

@final
class Figure:
    """A figure: drawn in notebooks as it is, written by `save`."""

    @property
    def size(self) -> tuple[float, float]:
        """Width and height on paper, in points (1/72 inch)."""

    def svg(self) -> str:
        """The figure as SVG."""

    def rgb(self, width: int, height: int) -> NDArray[np.uint8]:
        """The figure as pixels, height x width x 3."""

    def csv(self) -> str:
        """The numbers in the figure, as CSV."""

    def save(self, path: _Path, dpi: int | None = None) -> None:
        """Writes the figure in the format of the path's ending (.png, .svg, .pdf), and its numbers
        beside it as CSV."""

def task_names() -> list[str]:
    """Names of the shipped tasks."""

def level_names() -> list[str]:
    """Names of CREATE's levels: `create/NAME` is a task, `create/NAME-random` its random variant."""

def tool_numbers(split: str = "all") -> NDArray[np.int64]:
    """Numbers of the tools in a split of CREATE's catalogue, without the no-op: `"all"`, `"train"`,
    `"validation"` or `"test"`."""

def tool_features(numbers: Sequence[int]) -> _Float32:
    """What describes tools of the catalogue, a row for each number: one-hot of the type, then properties.
    Zeros are the no-op."""

def tool_feature_names() -> list[str]:
    """Names of the columns of `tool_features`."""

def model_names() -> list[str]:
    """Names of the shipped models."""

def tool_types() -> list[str]:
    """Names of the types of tools, by the number that the observation and `advance` give them."""

def words() -> list[list[str | None]]:
    """The words for the codes of `placement` and `end`; None for code 0."""

def build_prior(task: Task, model: Model | DynamicsModel | str, seed: int = 0, settings: str = "{}") -> ActionPrior:
    """Builds the action prior of a task from rollouts in a model.

    Args:
        model: a `Model`, `"physics"`, `"rapier"`, the name or path of a model, or one of your own.
        settings: JSON of those settings of guidance that are not the defaults.
    """

def rollout(
    task: Task, model: Model | DynamicsModel | str, actions: ArrayLike, start: State | None = None
) -> dict[str, NDArray[Any]]: ...
def read_run(path: _Path) -> tuple[str, str, dict[str, Any], dict[str, Any]]: ...
def read_results(folders: Sequence[_Path]) -> dict[str, Any]: ...
def write_report(
    folders: Sequence[_Path],
    out: _Path,
    resamples: int = 2000,
    confidence: float = 0.95,
    seed: int = 0,
    dpi: int | None = None,
) -> str: ...
def figure_tasks(tasks: Sequence[Task]) -> Figure: ...
def figure_learning(folders: Sequence[_Path], greedy: bool = False, steps: bool = False) -> Figure: ...
def figure_methods(folders: Sequence[_Path]) -> Figure: ...
def figure_clusters(task: Task, prior: ActionPrior, seed: int = 0) -> Figure: ...
