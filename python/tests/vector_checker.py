"""A checker of vector environments, as strict as Gymnasium's checker of single ones (Gymnasium has none for vectors).

It compares a vector environment with a `SyncVectorEnv` of single environments, the reference in
Gymnasium's documentation: in each autoreset mode, everything that `reset` and `step` return must be equal
to the bit, including infos and their masks, and of the types of the spaces.
"""

import copy

import gymnasium
import numpy as np
from gymnasium.spaces import Dict, MultiDiscrete
from gymnasium.vector import AutoresetMode, SyncVectorEnv


def same(ours, theirs, where):
    """Asserts equal types, shapes and bits; recursive for dictionaries and tuples."""
    if isinstance(theirs, dict):
        assert isinstance(ours, dict) and sorted(ours) == sorted(theirs), f"{where}: {sorted(ours)}, {sorted(theirs)}"
        for key in theirs:
            same(ours[key], theirs[key], f"{where}[{key!r}]")
        return
    assert type(ours) is type(theirs), f"{where}: {type(ours)}, not {type(theirs)}"
    if isinstance(theirs, tuple):
        for part, (one, other) in enumerate(zip(ours, theirs, strict=True)):
            same(one, other, f"{where}, part {part}")
        return
    if isinstance(theirs, np.ndarray):
        assert ours.dtype == theirs.dtype, f"{where}: {ours.dtype}, not {theirs.dtype}"
        assert ours.shape == theirs.shape, f"{where}: {ours.shape}, not {theirs.shape}"
        if theirs.dtype == object:
            for i, (one, other) in enumerate(zip(ours, theirs, strict=True)):
                same(one, other, f"{where}[{i}]")
        else:
            assert ours.tobytes() == theirs.tobytes(), f"{where} differs"
        return
    assert ours == theirs, f"{where}: {ours!r}, not {theirs!r}"


def draw(space, random):
    """Draws an action for each environment; places may be slightly outside the space."""
    if isinstance(space, Dict):
        return {name: draw(part, random) for name, part in space.items()}
    if isinstance(space, MultiDiscrete):
        return random.integers(0, space.nvec)
    return random.uniform(-1.2, 1.2, space.shape).astype(np.float32)


def check_vector(make_vector, make_single, num_envs=5, steps=60, seed=11):
    """Raises AssertionError at the first difference.

    Args:
        make_vector: makes the vector environment from a number and an autoreset mode.
        make_single: makes one environment.
    """
    for mode in AutoresetMode:
        ours = make_vector(num_envs, mode)
        theirs = SyncVectorEnv([make_single] * num_envs, autoreset_mode=mode)
        check_spaces(ours, theirs, mode)
        same(ours.reset(seed=seed), theirs.reset(seed=seed), f"{mode}: reset")
        actions = np.random.default_rng(seed)
        ended = 0
        kept = []
        for step in range(steps):
            action = draw(ours.action_space, actions)
            before = copy.deepcopy(action)
            got, expected = ours.step(action), theirs.step(action)
            same(got, expected, f"{mode}: step {step}")
            same(action, before, f"{mode}: the actions after step {step}")
            assert got[0] in ours.observation_space, f"{mode}: step {step} leaves the observation space"
            over = got[2] | got[3]
            ended += over.sum()
            if mode == AutoresetMode.DISABLED and over.any():
                options = {"reset_mask": over}
                same(
                    ours.reset(options=dict(options)), theirs.reset(options=dict(options)), f"{mode}: step {step}, reset"
                )
            kept.append((got[:2], copy.deepcopy(got[:2])))
        assert ended >= num_envs, f"{mode}: only {ended} episodes ended: play more steps"
        for returned, copied in kept:
            same(returned, copied, f"{mode}: an array returned was overwritten")
        # Resets in the middle of episodes: with a list of seeds, some of them None, and without seeds.
        seeds = [seed + 7, *[None] * (num_envs - 2), seed]
        same(ours.reset(seed=list(seeds)), theirs.reset(seed=list(seeds)), f"{mode}: seeds in a list")
        same(ours.reset(), theirs.reset(), f"{mode}: reset without a seed")
        same(ours.reset(seed=seed), theirs.reset(seed=seed), f"{mode}: the first seed again")
        check_closing(ours, mode)
        theirs.close()


def check_spaces(ours, theirs, mode):
    """The attributes that Gymnasium's wrappers and agents rely on."""
    assert isinstance(ours, gymnasium.vector.VectorEnv)
    assert ours.num_envs == theirs.num_envs
    for name in ("observation_space", "action_space", "single_observation_space", "single_action_space"):
        assert getattr(ours, name) == getattr(theirs, name), f"{mode}: {name}"
    assert ours.metadata["autoreset_mode"] is mode
    assert ours.unwrapped is ours and not ours.closed


def check_closing(envs, mode):
    """Closed once or twice, an environment refuses further use."""
    envs.close()
    envs.close()
    assert envs.closed
    for use in (envs.reset, lambda: envs.step(envs.action_space.sample())):
        try:
            use()
        except gymnasium.error.ClosedEnvironmentError:
            continue
        raise AssertionError(f"{mode}: a closed environment goes on")
