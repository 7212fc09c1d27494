"""The puzzles for agents of Stable-Baselines3 and SBX, which have their own type of vector environment.
Needs `stable-baselines3`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode

from mge._mge import Task
from mge.environments import PuzzleVectorEnv

if TYPE_CHECKING:
    from stable_baselines3.common.vec_env import (  # type: ignore[import-not-found, unused-ignore]
        base_vec_env as _types,
    )

try:
    from stable_baselines3.common.vec_env import VecEnv  # type: ignore[import-not-found, unused-ignore]
except ImportError:
    # Tools that import every module need not have it.
    VecEnv = object  # type: ignore[assignment, misc, unused-ignore]


class PuzzleVecEnv(VecEnv):
    """`PuzzleVectorEnv` as a `VecEnv`: `TD3("MlpPolicy", PuzzleVecEnv("task1", 8))`.

    Args:
        task: a `Task`, the name of a shipped one, or the path of a task file.
        num_envs: number of environments.
        num_threads: number of threads; None for all cores.
        tools, observation, rules: as in `PuzzleEnv`. With tools an action is three numbers in [-1, 1], since these
            agents have no mixed action spaces: the first selects the tool, by equal parts of its range.
    """

    def __init__(
        self,
        task: Task | str | os.PathLike[str] = "task1",
        num_envs: int = 1,
        num_threads: int | None = None,
        tools: str | None = None,
        observation: str | Sequence[str] = "vector",
        **rules: Any,
    ) -> None:
        if VecEnv is object:
            raise ImportError("mge.sb3 needs Stable-Baselines3: pip install stable-baselines3")
        self.envs = PuzzleVectorEnv(
            task=task,
            num_envs=num_envs,
            autoreset_mode=AutoresetMode.SAME_STEP,
            num_threads=num_threads,
            tools=tools,
            observation=observation,
            **rules,
        )
        self.render_mode = None
        self._tools = self.envs._tools or 0
        numbers = 2 if tools is None else 3
        self._actions = np.zeros((num_envs, numbers), np.float32)
        super().__init__(num_envs, self.envs.single_observation_space, Box(-1.0, 1.0, (numbers,), np.float32))

    def reset(self) -> _types.VecEnvObs:
        # `seed()` keeps the seeds for the next reset.
        seeds = self._seeds if any(seed is not None for seed in self._seeds) else None
        observations, _ = self.envs.reset(seed=seeds)
        self._reset_seeds()
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        self._actions = actions

    def step_wait(self) -> _types.VecEnvStepReturn:
        actions: Any = self._actions
        if self._tools:
            part = np.floor((actions[:, 0] + 1) / 2 * self._tools)
            actions = {"index": np.clip(part, 0, self._tools - 1).astype(np.int64), "pos": actions[:, 1:]}
        observations, rewards, terminated, truncated, infos = self.envs.step(actions)
        dones = terminated | truncated
        each: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(dones):
            each[i] = {
                "terminal_observation": infos["final_obs"][i],
                "TimeLimit.truncated": bool(truncated[i] and not terminated[i]),
                "is_success": bool(infos["final_info"]["is_success"][i]),
            }
        return observations, rewards.astype(np.float32), dones, each

    def close(self) -> None:
        self.envs.close()

    def get_attr(self, attr_name: str, indices: _types.VecEnvIndices = None) -> list[Any]:
        return [getattr(self.envs, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: _types.VecEnvIndices = None) -> None:
        raise AttributeError(f"`{attr_name}` cannot be set on single environments: use `envs`")

    def env_method(self, method_name: str, *method_args: Any, indices: _types.VecEnvIndices = None, **method_kwargs: Any) -> list[Any]:
        raise AttributeError(f"there is no `{method_name}` of single environments: use `envs`")

    def env_is_wrapped(self, wrapper_class: type, indices: _types.VecEnvIndices = None) -> list[bool]:
        return [False for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[np.ndarray | None]:
        core = self.envs._open()
        return [core.render(i, *self.envs.render_size) for i in range(self.num_envs)]
