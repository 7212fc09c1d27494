"""Checks assets/python/mge_gym.py with Gymnasium's own checker, and that episodes repeat.

    python tests/python/check_gym.py MGE_PROGRAM
"""

import sys
import warnings
from pathlib import Path

import numpy as np
from gymnasium.utils.env_checker import check_env

sys.path.insert(0, str(Path(__file__).parents[2] / "assets" / "python"))
from mge_gym import MgeEnv  # noqa: E402


def episode(env, seed, length=5):
    observation, _ = env.reset(seed=seed)
    seen, actions = [observation], np.random.default_rng(seed)
    for _ in range(length):
        observation, reward, terminated, truncated, _ = env.step(actions.uniform(-1, 1, 2))
        seen.append(np.append(observation, reward))
        if terminated or truncated:
            break
    return np.concatenate(seen)


def main(program):
    for task in ["task1", "task6"]:
        env = MgeEnv(task, program=[program])
        with warnings.catch_warnings():
            # Velocities have no bound, and the checker would rather have one.
            warnings.filterwarnings("ignore", message=".*(infinity|is not None|flatten).*")
            check_env(env, skip_render_check=True)
        np.testing.assert_array_equal(episode(env, 3), episode(env, 3))
        try:
            env.step([0.0, float("nan")])
            raise AssertionError("a NaN was accepted")
        except ValueError as error:
            assert "stdin" in str(error), error
        env.close()
        print(f"{task}: a Gymnasium environment")


if __name__ == "__main__":
    main(sys.argv[1])
