"""Ctrl-C ends every long call at once and leaves everything usable. Decided in `python/src/pool.rs`."""

import os
import pickle
import signal
import threading
import time

import numpy as np
import pytest

import mge

# Programs that a shell starts in the background ignore it.
signal.signal(signal.SIGINT, signal.default_int_handler)

TASK = mge.Task("task1")
MANY = np.random.default_rng(0).uniform(-1, 1, (20_000, 6, 2)).astype(np.float32)
LARGE = {"model_rollouts": 100000, "most_model_rollouts": 100000, "horizon": 6}


def shipped():
    return mge.Model.shipped_for(TASK)


def interrupted(call, after=0.3):
    """Calls, sends SIGINT, and returns how long the call then took to raise `KeyboardInterrupt`."""
    sent = []

    def send():
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(after, send)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            call()
            timer.join()  # A call that has already ended fails the test here.
            time.sleep(0.1)
            raise AssertionError("the call ended before the signal")
        return time.monotonic() - sent[0]
    finally:
        timer.join()


LONG = {
    "rollouts of the physics": lambda: mge.rollout(TASK, "physics", np.tile(MANY, (20, 1, 1))),
    "rollouts of rapier": lambda: mge.rollout(TASK, "rapier", MANY),
    "rollouts of a learned model": lambda: mge.rollout(TASK, shipped(), MANY),
    "predictions of many steps": lambda: shipped().predict(TASK, np.zeros((3, 5)), steps=2**32 - 1),
    "predictions of many balls": lambda: shipped().predict(TASK, np.zeros((50_000, 5)), steps=100),
    "a prior": lambda: mge.build_prior(TASK, "physics", **LARGE),
    "samples": lambda: SMALL_PRIOR.sample(0, 20_000_000, 0),
}
SMALL_PRIOR = mge.build_prior(TASK, "physics", model_rollouts=50, environment_rollouts=5)


@pytest.mark.parametrize("name", LONG)
def test_ctrl_c_ends_a_long_call(name):
    # It takes a fifth of a second; more where other programs keep the processor busy.
    assert interrupted(LONG[name]) < 3
    assert mge.rollout(TASK, "physics", MANY[:100]).hit.shape == (100,)


def test_ctrl_c_ends_a_step_and_a_reset_makes_the_environments_usable():
    envs = mge.PuzzleVectorEnv(TASK, 50_000)
    expected, _ = mge.PuzzleVectorEnv(TASK, 3).reset(seed=4)
    envs.reset(seed=0)
    actions = np.random.default_rng(0).uniform(-1, 1, (envs.num_envs, 2))

    def steps():
        while True:
            envs.step(actions)

    assert interrupted(steps) < 3
    assert (envs.reset(seed=4)[0][:3] == expected).all()
    envs.step(actions)


def test_ctrl_c_ends_a_report(run, tmp_path):
    assert interrupted(lambda: mge.write_report(run.parent, tmp_path / "report", resamples=1_000_000)) < 3
    assert len(mge.read_results(run.parent)["seed"]) == 2


def test_ctrl_c_ends_pickling_and_the_state_stays_whole():
    envs = mge.PuzzleVectorEnv(TASK, 20_000)
    envs.reset(seed=0)
    state = envs.get_state()

    def pickles():
        while True:
            pickle.loads(pickle.dumps(state))

    assert interrupted(pickles) < 3
    assert len(state) == 20_000 and (envs.set_state(state[7], [0])[0] == envs.set_state(state)[7]).all()


def test_a_signal_whose_handler_returns_changes_nothing():
    seen = []
    before = signal.signal(signal.SIGALRM, lambda *_: seen.append(1))
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.01, 0.05)
        rolled = mge.rollout(TASK, "rapier", MANY[:200])
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert seen
    np.testing.assert_array_equal(rolled.path, mge.rollout(TASK, "rapier", MANY[:200]).path)
