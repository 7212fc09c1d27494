"""Wrong arguments raise errors that say what is wrong, of the right type. Decided in `python/src/arguments.rs` and, for
what is a task, in `python/src/task.rs`."""

import copy
import json
import os
import pickle
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import mge

TASK = mge.Task("task1")


@pytest.fixture(scope="module")
def prior():
    return mge.build_prior(TASK, "physics", model_rollouts=50, environment_rollouts=5)


SEEDED = {
    "build_prior": lambda prior, seed: mge.build_prior(TASK, "physics", seed=seed),
    "sample": lambda prior, seed: prior.sample(0, 1, seed),
    "clusters": lambda prior, seed: mge.figures.clusters(TASK, prior, seed=seed),
    "write_report": lambda prior, seed: mge.write_report(".", "report", seed=seed),
    "PuzzleEnv": lambda prior, seed: mge.PuzzleEnv().reset(seed=seed),
    "PuzzleVectorEnv": lambda prior, seed: mge.PuzzleVectorEnv(num_envs=2).reset(seed=seed),
    "PuzzleVectorEnv, a list": lambda prior, seed: mge.PuzzleVectorEnv(num_envs=2).reset(seed=[1, seed]),
}


@pytest.mark.parametrize("name", SEEDED)
@pytest.mark.parametrize(
    ("seed", "error", "message"),
    [
        (-1, ValueError, "`seed` is -1, and should be from 0 to 18446744073709551615"),
        (2**64, ValueError, "`seed` is 18446744073709551616"),
        pytest.param(10**5000, ValueError, "`seed` is .{1,60}, and should be from 0", id="huge"),
        (np.int64(-3), ValueError, "`seed` is -3"),
        (1.0, TypeError, "`seed` is of type float, and should be a whole number"),
        (np.float32(1), TypeError, "`seed` is of type (numpy.)?float32"),
        (True, TypeError, "`seed` is of type bool"),
        ("1", TypeError, "`seed` is of type str"),
    ],
)
def test_wrong_seeds(name, seed, error, message, prior):
    with pytest.raises(error, match=message):
        SEEDED[name](prior, seed)


@pytest.mark.parametrize("seed", [0, 2**64 - 1, np.uint64(2**64 - 1), np.int8(3)])
def test_right_seeds(seed, prior):
    assert prior.sample(0, 2, seed).shape == (2, 2)
    assert mge.PuzzleEnv().reset(seed=seed)


COUNTS = {
    "count": (lambda prior, n: prior.sample(0, n, 0), [-1, 2**70], [1.5, None, True]),
    "stage": (lambda prior, n: prior.clusters(n), [-1, 2**70], [0.0, "goal"]),
    "steps": (lambda prior, n: mge.Model.shipped_for(TASK).predict(TASK, np.zeros((1, 5)), steps=n), [-1], [1.5]),
    "dpi": (lambda prior, n: mge.figures.tasks(TASK).save("never.png", dpi=n), [-1, 0], [96.0]),
    "resamples": (lambda prior, n: mge.write_report(".", "report", resamples=n), [-1, 0, 10**9], [1e3]),
    "num_envs": (lambda prior, n: mge.PuzzleVectorEnv(TASK, n), [-1, 0, 2**40], [2.0, "task2", True]),
    "num_threads": (lambda prior, n: mge.PuzzleVectorEnv(TASK, 2, num_threads=n), [-1, 0, 10**6], [1.0, True]),
    "render_size": (lambda prior, n: mge.PuzzleEnv(render_size=(n, 10)), [-1, 0], [9.5]),
    "number of a tool": (lambda prior, n: mge.tool_features([n]), [-1, 2366, 2**70], [1.0]),
}


@pytest.mark.parametrize("name", COUNTS)
def test_wrong_counts(name, prior):
    call, out_of_range, not_whole = COUNTS[name]
    for number in out_of_range:
        with pytest.raises(ValueError, match=f"`{name}` is {number}, and should be from"):
            call(prior, number)
    for value in not_whole:
        with pytest.raises(TypeError, match=f"`{name}` is of type {type(value).__name__}, and should be a whole"):
            call(prior, value)
    assert not os.path.exists("never.png")


def test_wrong_indices(prior):
    envs = mge.PuzzleVectorEnv(num_envs=2)
    state = envs.get_state()
    for index in (2, -3, 2**40):
        with pytest.raises(IndexError, match=f"there is no state {index}: there are 2"):
            state[index]
    for index in (0.0, True):
        with pytest.raises(TypeError, match="whole number"):
            state[index]
        with pytest.raises(TypeError, match="whole number"):
            envs.get_state([index])
    with pytest.raises(IndexError, match="no environment -1"):
        envs.get_state([-1])
    with pytest.raises(IndexError, match="no stage 9"):
        prior.sample(9, 1, 0)


def test_more_than_fits_into_memory_is_an_error(prior):
    with pytest.raises(MemoryError, match="no memory"):
        prior.sample(0, 2**50, 0)
    with pytest.raises(MemoryError, match="no memory"):
        mge.PuzzleVectorEnv(TASK, 2**31 - 1)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_numbers_that_are_not_finite_are_named_by_their_index(wrong, prior, run):
    actor, model = mge.Actor(run), mge.Model.shipped_for(TASK)
    observations = np.zeros((4, TASK.observation_len))
    actions = actor.act(observations)
    said = str(np.float32(wrong)).replace("nan", "NaN")
    observations[2, 7] = wrong
    with pytest.raises(ValueError, match=rf"`observations` is {said} at index \[2, 7\]"):
        actor.act(observations)
    with pytest.raises(ValueError, match=rf"`observations` is {said} at index \[2, 7\]"):
        actor.values(observations, actions)
    actions[3, 1] = wrong
    with pytest.raises(ValueError, match=rf"`actions` is {said} at index \[3, 1\]"):
        actor.values(np.zeros_like(observations), actions)
    with pytest.raises(ValueError, match=rf"`actions` is {said} at index \[0, 3, 1\]"):
        mge.rollout(TASK, "physics", actions[None])
    with pytest.raises(ValueError, match=rf"`balls` is {said} at index \[1, 4\]"):
        model.predict(TASK, [[0] * 5, [0, 0, 0, 0, wrong]])


def tasks(folder):
    """A task in every form in which a call takes it."""
    path = folder / "copy.json"
    TASK.save(path)
    return [TASK, "task1", str(path), path]


def test_every_call_with_a_task_takes_a_name_a_path_or_a_task(prior, tmp_path):
    model = mge.Model.shipped_for(TASK)
    text = prior.to_json()
    calls = [
        lambda task: mge.Task(task).to_json(),
        lambda task: mge.Model.shipped_for(task).name,
        lambda task: model.predict(task, np.zeros((1, 5))).tolist(),
        lambda task: mge.rollout(task, model, np.zeros((1, 1, 2))).path.tolist(),
        lambda task: mge.rollout(task, "physics", np.zeros((1, 1, 2))).path.tolist(),
        lambda task: mge.build_prior(task, "physics", model_rollouts=50).to_json(),
        lambda task: mge.ActionPrior.parse(text, task).to_json(),
        lambda task: mge.figures.tasks(task, task).csv(),
        lambda task: mge.figures.clusters(task, prior).csv(),
        lambda task: mge.PuzzleEnv(task).task.to_json(),
        lambda task: mge.PuzzleVectorEnv(task=task).task.to_json(),
    ]
    for call in calls:
        first, *others = [call(task) for task in tasks(tmp_path)]
        assert all(other == first for other in others)
        for wrong in (3, None, ["task1"]):
            with pytest.raises(TypeError, match=f"{type(wrong).__name__} is not a task: give"):
                call(wrong)
        with pytest.raises(ValueError, match="no task `task9`.*did you mean"):
            call("task9")


def test_the_rules_of_a_task_are_arguments():
    rules = {"start_noise": np.float32(0.25), "max_actions": np.int64(3), "rewards": {"step": -1}, "gravity": [0, -2]}
    env = mge.PuzzleEnv("task2", **rules)
    assert env.task == mge.Task("task2", **rules) != mge.Task("task2")
    found = json.loads(env.task.to_json())["rules"]
    assert (found["start_noise"], found["rewards"]["step"], found["gravity"]) == (0.25, -1, [0, -2])
    assert gymnasium.make_vec("mge/task2-v0", num_envs=2, **rules).unwrapped.task == env.task
    assert pickle.loads(pickle.dumps(env)).task.max_actions == 3
    with pytest.raises(TypeError, match="no rule `startnoise`: did you mean `start_noise`"):
        mge.PuzzleEnv("task2", startnoise=0.1)
    with pytest.raises(ValueError, match="rules.start_noise: is 5"):
        mge.Task("task2", start_noise=5)
    with pytest.raises(TypeError, match="`start_noise` is of type object"):
        mge.Task("task2", start_noise=object())


def test_shown_values_are_short(run, tmp_path):
    read = mge.read_run(run)
    assert repr(read) == "<Run of task1, finished, 40 episodes>"
    assert "Table of 40 rows" in repr(read.episodes) and "Table of 4 rows" in repr(read.evaluations)
    report = mge.write_report(run.parent, tmp_path / "report", resamples=50)
    shown = [
        *read, report, mge.read_results(run.parent), mge.Actor(run), mge.ActionPrior.of_run(run),
        mge.rollout(TASK, "physics", np.zeros((500, 3, 2))), mge.Model.shipped_for(TASK), TASK,
        mge.PuzzleVectorEnv(num_envs=300).get_state(), mge.figures.tasks(TASK), mge.PuzzleEnv(), mge.PuzzleVectorEnv(),
    ]  # fmt: skip
    for value in shown[1:]:
        assert len(repr(value)) < 200, repr(value)
    assert dict(read.episodes).keys() == read.episodes.keys(), "all of it is still there"


def test_what_can_be_pickled(prior, run):
    model = mge.Model.shipped_for(TASK)
    other = pickle.loads(pickle.dumps(model))
    actions = np.random.default_rng(0).uniform(-1, 1, (20, 2, 2))
    for ours, theirs in zip(mge.rollout(TASK, model, actions), mge.rollout(TASK, other, actions), strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert pickle.loads(pickle.dumps(prior)).to_json() == copy.deepcopy(prior).to_json() == prior.to_json()
    read = pickle.loads(pickle.dumps(mge.read_run(run)))
    assert isinstance(read, mge.Run) and isinstance(read.episodes, mge.Table)
    empty = mge.PuzzleVectorEnv().get_state([])
    assert len(pickle.loads(pickle.dumps(empty))) == 0
    for call in (mge.build_prior, mge.rollout, mge.Task.parse, mge.PuzzleVectorEnv):
        assert pickle.loads(pickle.dumps(call)) == call


@pytest.mark.parametrize("settings", [{}, {"observation": ["objects", "vector"]}, {"task": "create/Push", "tools": "all"}])
def test_environments_are_pickled_as_they_are(settings):
    envs = mge.PuzzleVectorEnv(num_envs=3, **settings)
    env = mge.PuzzleEnv(**settings)
    for one in (env, envs):
        one.reset(seed=1)
        one.action_space.seed(2)
        one.step(one.action_space.sample())
        for other in (pickle.loads(pickle.dumps(one)), copy.deepcopy(one)):
            again = pickle.loads(pickle.dumps(one))
            for _ in range(8):
                action = other.action_space.sample()
                np.testing.assert_equal(again.action_space.sample(), action)
                seen = other.step(action)
                np.testing.assert_equal(seen, again.step(action))
                if one is env and (seen[2] or seen[3]):
                    break
        one.close()
        with pytest.raises(Exception, match="closed"):
            pickle.loads(pickle.dumps(one)).reset()
    fresh = pickle.loads(pickle.dumps(mge.PuzzleEnv(**settings)))
    with pytest.raises(Exception, match="reset that environment before the next step"):
        fresh.step(fresh.action_space.sample())


def test_what_cannot_be_pickled_says_what_to_do(run):
    for value, remedy in [(mge.Actor(run), "path of its run"), (mge.figures.tasks(TASK), "svg")]:
        with pytest.raises(TypeError, match=f"cannot be pickled: .*{remedy}"):
            pickle.dumps(value)


def test_a_file_that_is_not_a_report(tmp_path):
    for text in ("", "[1]", "{", "3"):
        (tmp_path / "report.json").write_text(text)
        with pytest.raises(ValueError, match="report.json is not a report"):
            mge.read_report(tmp_path)
    (tmp_path / "report.json").write_text("\ufeff" + json.dumps({"learning": [{"seed": 1}]}), encoding="utf-8")
    assert mge.read_report(Path(tmp_path), "learning")["seed"] == [1]
