"""The puzzles as Gymnasium environments: a single one (`PuzzleEnv`), or many stepped by one call
(`PuzzleVectorEnv`)."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from math import prod
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ClosedEnvironmentError
from gymnasium.spaces import Box, Dict, Discrete, Space
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from mge import _mge
from mge._mge import State, Task

PLACEMENTS, ENDS = (np.array(words, dtype=object) for words in _mge.words())
METADATA = {"render_modes": ["rgb_array"], "render_fps": 4}
DEFAULT_SIZE = (480, 480)


def register() -> None:
    """Registers the tasks with Gymnasium: `mge/task1-v0` and so on; CREATE's levels with a choice of tools,
    `mge/create-push-v0` and `mge/create-push-random-v0`; and `mge/Task-v0`, which takes any task
    or task file as `task`."""
    tasks: dict[str, dict[str, str]] = {name: {"task": name} for name in _mge.task_names()}
    for level in _mge.level_names():
        for variant in ("", "-random"):
            tasks[f"create-{level.lower()}{variant}"] = {"task": f"create/{level}{variant}", "tools": "train"}
    for name, arguments in {**tasks, "Task": {}}.items():
        id = f"mge/{name}-v0"
        if id not in gymnasium.registry:
            gymnasium.register(
                id=id,
                entry_point="mge.environments:PuzzleEnv",
                vector_entry_point="mge.environments:PuzzleVectorEnv",
                kwargs=arguments,
            )


class _Parts:
    """The requested parts of observations, and where they are in the arrays.

    Args:
        core: the environments.
        observation: one name (`"vector"`, or a part of the vector) for that array, or several names for a dictionary.
    """

    def __init__(self, core: _mge.VectorCore, observation: str | Sequence[str]) -> None:
        low, high = core.bounds()
        places: dict[str, tuple[slice, tuple[int, ...]]] = {"vector": (slice(None), low.shape)}
        first = 0
        for name, shape in core.parts():
            places[name] = (slice(first, first + prod(shape)), tuple(shape))
            first += prod(shape)
        self._is_one = isinstance(observation, str)
        self._places: dict[str, tuple[slice, tuple[int, ...]]] = {}
        spaces: dict[str, Space[Any]] = {}
        for name in _names(observation):
            if name not in places:
                raise ValueError(f"an observation has no part {name!r}: use some of {list(places)}")
            at, sides = self._places[name] = places[name]
            spaces[name] = Box(low[at].reshape(sides), high[at].reshape(sides), sides, np.float32)
        self.space: Space[Any] = next(iter(spaces.values())) if self._is_one else Dict(spaces)

    def of(self, rows: np.ndarray, copy: bool) -> Any:
        """The requested parts of all environments, or of one."""
        parts: dict[str, Any] = {}
        for name, (at, sides) in self._places.items():
            part = rows if name == "vector" else rows[..., at].reshape(*rows.shape[:-1], *sides)
            parts[name] = part.copy() if copy else part
        return next(iter(parts.values())) if self._is_one else parts


def _names(observation: str | Sequence[str]) -> list[str]:
    names = [observation] if isinstance(observation, str) else list(observation)
    if not names:
        raise ValueError("`observation` names nothing: use 'vector', or names of parts")
    return names


def _action_space(tools: int | None) -> Space[Any]:
    place = Box(-1.0, 1.0, (2,), np.float32)
    return place if tools is None else Dict({"index": Discrete(tools), "pos": place})


def _numbers(values: Any, shape: tuple[int, ...], what: str) -> np.ndarray:
    """Numbers of any type. Reports wrong shapes and types; the library reports numbers that are not finite."""
    values = np.asarray(values)
    if values.shape != shape:
        raise ValueError(f"the {what} have the shape {values.shape}, and should have {shape}")
    if values.dtype.kind not in "fiu":
        raise TypeError(f"the {what} are of type {values.dtype}, and should be numbers, such as float32")
    return values


def _step(core: _mge.VectorCore, tools: int | None, actions: Any, shape: tuple[int, ...]) -> None:
    """Takes one action in each environment. `tools` is the number of tools to choose among; `shape` is () for a
    single environment."""
    if tools is None:
        core.step(_floats(_numbers(actions, (*shape, 2), "actions")))
        return
    if isinstance(actions, Mapping):
        if set(actions) != {"index", "pos"}:
            raise ValueError(f"an action has the parts {sorted(actions)}, and should have 'index' and 'pos'")
        index, places = _numbers(actions["index"], shape, "indices"), _numbers(actions["pos"], (*shape, 2), "places")
    else:
        # CREATE's order: the index before the place.
        actions = _numbers(actions, (*shape, 3), "actions")
        index, places = actions[..., 0], actions[..., 1:]
    if index.dtype.kind == "f":
        if not np.isfinite(index).all():
            raise ValueError(f"the index of a tool is not a finite number: {index.tolist()}")
        index = np.round(index)
    core.step(_floats(places), np.ascontiguousarray(index, dtype=np.int64).reshape(-1))


def _floats(places: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(places, dtype=np.float32).reshape(-1, 2)


def _seed(seed: Any) -> int | None:
    return None if seed is None else _mge.whole(seed, "seed", 0, 2**64 - 1)


class _Puzzles:
    """What a single environment and a vector have in common: their part in Rust. It is pickled as its state."""

    def _begin(
        self,
        task: Task | str | os.PathLike[str],
        num_envs: int,
        autoreset_mode: str,
        num_threads: int | None,
        tools: str | None,
        observation: str | Sequence[str],
        render_mode: str | None,
        render_size: tuple[int, int],
        rules: dict[str, Any],
    ) -> None:
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f"there is no render mode {render_mode!r}: use None or 'rgb_array'")
        if len(render_size) != 2:
            raise ValueError("`render_size` is a pair: width and height in pixels")
        width, height = (_mge.whole(side, "render_size", 1, 2**32 - 1) for side in render_size)
        self.task = Task(task, **rules)
        self.render_mode = render_mode
        self.render_size = width, height
        self._made_by = self.task, num_envs, autoreset_mode, num_threads, tools
        core = self._make()
        self._parts = _Parts(core, observation)
        self._tools = core.tool_count

    def _make(self) -> _mge.VectorCore:
        core = _mge.VectorCore(*self._made_by)
        self._core: _mge.VectorCore | None = core
        self._observations, self._rewards, self._terminated, self._truncated = core.arrays()
        self._facts = core.facts()
        return core

    def _open(self) -> _mge.VectorCore:
        if self._core is None:
            raise ClosedEnvironmentError("the environment is closed: make another")
        return self._core

    def __getstate__(self) -> dict[str, Any]:
        of_core = ("_core", "_observations", "_rewards", "_terminated", "_truncated", "_facts")
        kept = {name: value for name, value in self.__dict__.items() if name not in of_core}
        saved = None if self._core is None else self._core.state(range(self._made_by[1]))
        return {**kept, "_saved": saved}

    def __setstate__(self, state: dict[str, Any]) -> None:
        saved = state["_saved"]
        self.__dict__.update({name: value for name, value in state.items() if name != "_saved"})
        core = self._make()
        if saved is None:
            self._core = None
        else:
            core.restore(range(self._made_by[1]), saved)


class PuzzleEnv(_Puzzles, gymnasium.Env[Any, Any]):
    """A puzzle: each action places one tool and simulates 1.33 seconds.

    Args:
        task: a `Task`, the name of a shipped one, `"create/Push"`, or the path of a task file.
        tools: None: the agent places the task's own tool. `"train"`, `"validation"`, `"test"` or `"all"`:
            it chooses among 40 of CREATE's tools, which every reset draws from that split.
        observation: `"vector"`, or the name of a part of the vector; or a list of these, such as
            `["objects", "stage"]`, for a dictionary.
        render_mode: None or `"rgb_array"`.
        render_size: width and height of rendered images, in pixels.
        rules: rules of the task that differ, as in `Task`: `start_noise=0.1`, `max_actions=10` and so on.

    The observation has 16 objects (velocity, position, one-hot type) and a one-hot encoding of the next
    stage; the action is the normalised place of the tool. With tools the observation has 48 objects
    with their properties, the progress, and the 40 tools; the action is `{"index": 3, "pos": [x, y]}`,
    or CREATE's `[3, x, y]`. `info` has `is_success`, `subgoals` (reached), `placed` (number of tools),
    `placement` (`placed`, `no_op`, `overlap`, `collision`), `end` (why the episode ended) and, with
    tools, `tools` (their numbers in the catalogue). A seed determines the episode to the bit, equal to that of
    `mge env serve --seed`.
    """

    metadata: dict[str, Any] = METADATA

    def __init__(
        self,
        task: Task | str | os.PathLike[str] = "task1",
        tools: str | None = None,
        observation: str | Sequence[str] = "vector",
        render_mode: str | None = None,
        render_size: tuple[int, int] = DEFAULT_SIZE,
        **rules: Any,
    ) -> None:
        self._begin(task, 1, "Disabled", 1, tools, observation, render_mode, render_size, rules)
        self.observation_space, self.action_space = self._parts.space, _action_space(self._tools)
        self._seeded = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begins an episode. Without a seed the random streams continue; the first reset without one uses a
        random seed."""
        core, seed = self._open(), _seed(seed)
        super().reset(seed=seed)
        if seed is None and not self._seeded:
            seed = int(self.np_random.integers(2**63))
        core.reset([seed])
        self._seeded = True
        return self._seen(), self._info()

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Places a tool at a normalised place (clipped to [-1, 1]) if the placement is allowed, and
        simulates 1.33 seconds."""
        _step(self._open(), self._tools, action, ())
        return (
            self._seen(),
            float(self._rewards[0]),
            bool(self._terminated[0]),
            bool(self._truncated[0]),
            self._info(),
        )

    def render(self) -> np.ndarray | None:
        """The current scene, uint8 of height x width x 3. Planks are shown as they were placed."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() needs render_mode='rgb_array'")
            return None
        return self._open().render(0, *self.render_size)

    def get_state(self) -> State:
        """The current state of the episode and of the random streams; can be pickled."""
        return self._open().state([0])

    def set_state(self, state: State) -> tuple[Any, dict[str, Any]]:
        """Continues from a state of an environment of the same task. Returns the same as `reset`."""
        self._open().restore([0], state)
        self._seeded = True
        return self._seen(), self._info()

    def close(self) -> None:
        """Closes the environment: any further use raises an error; closing again does not."""
        self._core = None

    def _seen(self) -> Any:
        return self._parts.of(self._observations[0], copy=True)

    def _info(self) -> dict[str, Any]:
        facts = self._facts
        info = {
            "is_success": bool(facts["is_success"][0]),
            "subgoals": facts["subgoals"][0].copy(),
            "placed": int(facts["placed"][0]),
            "placement": PLACEMENTS[facts["placement"][0]],
            "end": ENDS[facts["end"][0]],
        }
        if "tools" in facts:
            info["tools"] = facts["tools"][0].copy()
        return info


class PuzzleVectorEnv(_Puzzles, VectorEnv[Any, Any, np.ndarray]):
    """Many environments of one puzzle, stepped by one call on all cores.

    Args:
        task, tools, observation, rules: as in `PuzzleEnv`.
        num_envs: number of environments.
        autoreset_mode: what happens after the end of an episode, as in Gymnasium: `NEXT_STEP`,
            `SAME_STEP` or `DISABLED`.
        copy: whether `reset` and `step` return copies of the observations. If False, they return one
            array, which the next call overwrites.
        num_threads: number of threads; None for all cores. Results do not depend on it.
        render_mode: None or `"rgb_array"`.
        render_size: width and height of rendered images, in pixels.

    Ctrl-C interrupts `reset`, `step` and `set_state`; only some environments may then have changed, and all need a
    reset.

    Behaves like a `SyncVectorEnv` of as many `PuzzleEnv`: environment i of a vector reset with seed s equals
    a `PuzzleEnv` reset with seed s + i, to the bit.
    """

    metadata: dict[str, Any] = {**METADATA, "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        task: Task | str | os.PathLike[str] = "task1",
        num_envs: int = 1,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        num_threads: int | None = None,
        render_mode: str | None = None,
        render_size: tuple[int, int] = DEFAULT_SIZE,
        tools: str | None = None,
        observation: str | Sequence[str] = "vector",
        **rules: Any,
    ) -> None:
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**METADATA, "autoreset_mode": self.autoreset_mode}
        mode = self.autoreset_mode.value
        self._begin(task, num_envs, mode, num_threads, tools, observation, render_mode, render_size, rules)
        self.num_envs = num_envs
        self.copy = copy
        self.single_observation_space, self.single_action_space = self._parts.space, _action_space(self._tools)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._seeded = np.zeros(num_envs, dtype=np.bool_)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Begins episodes.

        Args:
            seed: a number s gives environment i the seed s + i; a list gives each its own. Without a seed
                an environment's random streams continue; its first reset without one uses a random seed.
            options: `{"reset_mask": mask}` resets only the environments where the boolean array is true.
        """
        core = self._open()
        mask = self._mask(options)
        if isinstance(seed, (list, tuple, np.ndarray)):
            if len(seed) != self.num_envs:
                raise ValueError(f"there are {len(seed)} seeds for {self.num_envs} environments")
            seeds = [_seed(one) for one in seed]
        else:
            first = _seed(seed)
            super().reset(seed=first)
            seeds = [None if first is None else _seed(first + i) for i in range(self.num_envs)]
        for i in np.flatnonzero(~self._seeded & (True if mask is None else mask)):
            if seeds[i] is None:
                seeds[i] = int(self.np_random.integers(2**63))
        core.reset(seeds, mask)
        self._seeded |= True if mask is None else mask
        return self._seen(), self._infos(self._facts, mask)

    def step(self, actions: Any) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Takes one action in each environment: normalised places of tools, num_envs x 2. With tools:
        `{"index": ..., "pos": ...}` of num_envs and num_envs x 2, or an array of num_envs x 3."""
        core = self._open()
        _step(core, self._tools, actions, (self.num_envs,))
        infos: dict[str, Any] = {}
        if self.autoreset_mode == AutoresetMode.SAME_STEP and (ended := core.ended()) is not None:
            self._add_final(infos, *ended)
        infos.update(self._infos(self._facts, None))
        return self._seen(), self._rewards.copy(), self._terminated.copy(), self._truncated.copy(), infos

    def render(self) -> tuple[np.ndarray, ...] | None:
        """The current scenes, as `PuzzleEnv.render` shows them, each uint8 of height x width x 3."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() needs render_mode='rgb_array'")
            return None
        core = self._open()
        return tuple(core.render(i, *self.render_size) for i in range(self.num_envs))

    def get_state(self, indices: Sequence[int] | None = None) -> State:
        """The states of these environments, or of all: episodes and random streams. Can be
        pickled; `state[i]` is a single state."""
        return self._open().state(self._indices(indices))

    def set_state(self, state: State, indices: Sequence[int] | None = None) -> Any:
        """Continues from states of environments of the same task: one state per environment of `indices`
        (default: all), or one state for all of them. Returns the observations of all environments."""
        places = self._indices(indices)
        self._open().restore(places, state)
        self._seeded[places] = True
        return self._seen()

    def close_extras(self, **kwargs: Any) -> None:
        """Closes the environments; called by `close`."""
        self._core = None

    def _indices(self, indices: Sequence[int] | None) -> list[int]:
        if indices is None:
            return list(range(self.num_envs))
        places = [_mge.whole(i, "index of an environment", -(2**63), 2**63 - 1) for i in indices]
        for place in places:
            if not 0 <= place < self.num_envs:
                raise IndexError(f"there is no environment {place}: they are counted from 0 to {self.num_envs - 1}")
        return places

    def _mask(self, options: dict[str, Any] | None) -> np.ndarray | None:
        if options is None or "reset_mask" not in options:
            return None
        mask = options["reset_mask"]
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
            raise TypeError("options['reset_mask'] is not a NumPy array of bool")
        if mask.shape != (self.num_envs,):
            raise ValueError(f"options['reset_mask'] has the shape {mask.shape}, and should have {(self.num_envs,)}")
        if not mask.any():
            raise ValueError("options['reset_mask'] names no environment")
        return mask

    def _seen(self) -> Any:
        return self._parts.of(self._observations, self.copy)

    def _infos(self, facts: dict[str, np.ndarray], mask: np.ndarray | None) -> dict[str, Any]:
        """Facts in the format of Gymnasium's vector environments: each with a mask of the environments that have it."""
        infos: dict[str, Any] = {}
        for name, values in facts.items():
            if name in ("placement", "end"):
                values = (PLACEMENTS if name == "placement" else ENDS).take(values)
            else:
                values = values.copy()
            if mask is not None:
                values[~mask] = None if values.dtype == object else 0
            infos[name] = values
            infos[f"_{name}"] = np.ones(self.num_envs, dtype=np.bool_) if mask is None else mask.copy()
        return infos

    def _add_final(
        self,
        infos: dict[str, Any],
        which: np.ndarray,
        observations: np.ndarray,
        facts: dict[str, np.ndarray],
    ) -> None:
        """The ends of episodes whose environments have already begun the next."""
        mask = np.zeros(self.num_envs, dtype=np.bool_)
        mask[which] = True
        final = np.full(self.num_envs, None, dtype=object)
        for place, i in enumerate(which):
            final[i] = self._parts.of(observations[place], copy=False)
        spread = {name: np.zeros((self.num_envs, *values.shape[1:]), values.dtype) for name, values in facts.items()}
        for name, values in facts.items():
            spread[name][which] = values
        infos["final_obs"], infos["_final_obs"] = final, mask
        infos["final_info"], infos["_final_info"] = self._infos(spread, mask), mask.copy()
