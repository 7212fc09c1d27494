"""Third-party agents train on the environments: TD3 of Stable-Baselines3, SAC of SBX."""

import gymnasium
import numpy as np
import pytest

import mge

pytest.importorskip("stable_baselines3")

STEPS = 400


def check_learning(model, before, after):
    model.learn(STEPS)
    assert model.num_timesteps >= STEPS
    assert any((old != new).any() for old, new in zip(before, after(), strict=True)), "nothing was learned"
    action, _ = model.predict(np.zeros((1, model.observation_space.shape[0]), np.float32), deterministic=True)
    assert action.shape == (1, *model.action_space.shape) and np.isfinite(action).all()


@pytest.mark.parametrize("kind", ["single", "vector", "tools"])
def test_td3_of_stable_baselines3(kind):
    import torch
    from mge.sb3 import PuzzleVecEnv
    from stable_baselines3 import TD3
    from stable_baselines3.common.vec_env import VecMonitor

    torch.set_num_threads(1)
    env = {
        "single": lambda: gymnasium.make("mge/task1-v0"),
        "vector": lambda: VecMonitor(PuzzleVecEnv("task1", 4)),
        "tools": lambda: VecMonitor(PuzzleVecEnv("create/Push-random", 4, tools="train")),
    }[kind]()
    model = TD3("MlpPolicy", env, buffer_size=2000, learning_starts=100, policy_kwargs={"net_arch": [32, 32]}, seed=0)

    def weights():
        return [parameter.detach().numpy().copy() for parameter in model.actor.parameters()]

    check_learning(model, weights(), weights)
    assert len(model.ep_info_buffer) > 5 and len(model.ep_success_buffer) > 5


def test_sac_of_sbx():
    jax = pytest.importorskip("jax")
    sbx = pytest.importorskip("sbx")
    from mge.sb3 import PuzzleVecEnv

    env = PuzzleVecEnv("task1", 4)
    model = sbx.SAC("MlpPolicy", env, learning_starts=100, policy_kwargs={"net_arch": [32, 32]}, seed=0)

    def weights():
        return [np.array(leaf) for leaf in jax.tree_util.tree_leaves(model.policy.actor_state.params)]

    check_learning(model, weights(), weights)


def test_the_adapter_equals_a_dummy_vec_env_of_single_environments():
    from mge.sb3 import PuzzleVecEnv
    from stable_baselines3.common.vec_env import DummyVecEnv

    ours, theirs = PuzzleVecEnv("task5", 3), DummyVecEnv([lambda: mge.PuzzleEnv("task5")] * 3)
    for envs in (ours, theirs):
        envs.seed(9)
    assert (ours.reset() == theirs.reset()).all()
    ended = 0
    for actions in np.random.default_rng(0).uniform(-1, 1, (60, 3, 2)).astype(np.float32):
        (o, r, d, i), (other_o, other_r, other_d, other_i) = ours.step(actions), theirs.step(actions)
        assert (o == other_o).all() and (r == other_r).all() and (d == other_d).all()
        for k in np.flatnonzero(d):
            ended += 1
            assert (i[k]["terminal_observation"] == other_i[k]["terminal_observation"]).all()
            for name in ("TimeLimit.truncated", "is_success"):
                assert i[k][name] == other_i[k][name]
    assert ended > 3
