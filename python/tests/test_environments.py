"""The environments: Gymnasium's checks, our checks for vectors, states, misuse."""

import copy
import os
import pickle

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from vector_checker import check_vector

import mge


@pytest.fixture(scope="module")
def noisy(tmp_path_factory):
    """A task file whose start depends on the seed."""
    import json

    task = json.loads(mge.Task("task5").to_json())
    task["name"] = "noisy"
    task["rules"]["start_noise"] = 0.05
    path = tmp_path_factory.mktemp("tasks") / "noisy.json"
    path.write_text(json.dumps(task))
    return str(path)


@pytest.mark.parametrize("name", mge.task_names())
@pytest.mark.filterwarnings("ignore:.*infinity.*")
def test_environments_pass_gymnasiums_checker(name):
    check_env(gymnasium.make(f"mge/{name}-v0", render_mode="rgb_array").unwrapped)


@pytest.mark.parametrize("level", mge.level_names())
@pytest.mark.parametrize("variant", ["", "-random"])
@pytest.mark.filterwarnings("ignore:.*infinity.*")
def test_levels_of_create_pass_gymnasiums_checker(level, variant):
    env = gymnasium.make(f"mge/create-{level.lower()}{variant}-v0", render_mode="rgb_array", render_size=(84, 84))
    check_env(env.unwrapped)
    assert env.action_space["index"].n == 40
    parts = gymnasium.make(env.spec.id, tools="test", observation=["objects", "progress", "tools"]).unwrapped
    check_env(parts, skip_render_check=True)
    observation, info = parts.reset(seed=1)
    assert (observation["tools"] == mge.tool_features(info["tools"])).all()


def test_a_level_of_create_can_be_played_with_its_own_tool():
    env = gymnasium.make("mge/create-push-v0", tools=None)
    assert env.action_space.shape == (2,)
    assert "tools" not in env.reset(seed=0)[1]


@pytest.mark.parametrize("observation", ["vector", "objects", ["tools", "progress"]])
@pytest.mark.parametrize("threads", [1, 2])
def test_a_vector_with_tools_equals_single_environments(threads, observation):
    settings = {"task": "create/Ladder-random", "tools": "train", "observation": observation}
    check_vector(
        lambda n, mode: mge.PuzzleVectorEnv(num_envs=n, autoreset_mode=mode, num_threads=threads, **settings),
        lambda: mge.PuzzleEnv(**settings),
        steps=100,
    )


def test_an_action_with_a_tool_is_a_dictionary_or_an_array_as_in_create():
    envs = mge.PuzzleVectorEnv("create/Push", 3, tools="train")

    def step(actions):
        _, infos = envs.reset(seed=2)
        observations, *_, after = envs.step(actions)
        assert (infos["tools"] == after["tools"]).all() and infos["tools"].shape == (3, 40)
        return observations, after["placement"].tolist()

    index, places = np.array([1, 0, 39]), np.array([[-0.5, 0.9], [0, 0], [0.5, -0.9]], np.float32)
    observations, placements = step({"index": index, "pos": places})
    assert placements[1] == "no_op" and placements[0] != "no_op"
    again = step(np.column_stack([index, places]))
    assert (again[0] == observations).all() and again[1] == placements
    one = mge.PuzzleEnv("create/Push", tools="train")
    one.reset(seed=2)
    assert (one.step({"index": 1, "pos": places[0]})[0] == observations[0]).all()
    for wrong, error, message in [
        (places, ValueError, r"shape \(3, 2\), and should have \(3, 3\)"),
        ({"index": index}, ValueError, "'index' and 'pos'"),
        ({"index": index[:2], "pos": places}, ValueError, "indices have the shape"),
        ({"index": index == 1, "pos": places}, TypeError, "indices are of type bool"),
        ({"index": [0, 0, 40], "pos": places}, ValueError, "environment 2 asks for tool 40"),
        ({"index": [0, -1, 0], "pos": places}, ValueError, "environment 1 asks for tool -1"),
        ({"index": [0, np.nan, 0], "pos": places}, ValueError, "not a finite number"),
        ({"index": index, "pos": places * np.nan}, ValueError, "NaN"),
    ]:
        state = pickle.dumps(envs.get_state())
        with pytest.raises(error, match=message):
            envs.step(wrong)
        assert pickle.dumps(envs.get_state()) == state
    with pytest.raises(ValueError, match="unknown split of tools `best`"):
        mge.PuzzleEnv("create/Push", tools="best")
    with pytest.raises(ValueError, match="no part 'smell'"):
        mge.PuzzleEnv("create/Push", tools="all", observation="smell")
    with pytest.raises(ValueError, match="tools"):
        mge.PuzzleEnv("create/Push", tools="test").set_state(one.get_state())


def test_the_catalogue_of_tools():
    assert len(mge.tool_numbers()) == 2365
    splits = [set(mge.tool_numbers(split).tolist()) for split in ("train", "validation", "test")]
    assert not (splits[0] & splits[1] | splits[0] & splits[2] | splits[1] & splits[2])
    features = mge.tool_features([0, 2365])
    assert features.shape == (2, len(mge.tool_feature_names())) and features[0].any() and not features[1].any()
    with pytest.raises(ValueError, match="`number of a tool` is 2366"):
        mge.tool_features([2366])
    with pytest.raises(ValueError, match="unknown split of tools"):
        mge.tool_numbers("none")


@pytest.mark.parametrize("name", ["task1", "task6", "noisy"])
@pytest.mark.parametrize("threads", [1, 2, None])
def test_a_vector_equals_single_environments(name, threads, noisy):
    task = noisy if name == "noisy" else name
    check_vector(
        lambda n, mode: mge.PuzzleVectorEnv(task, n, mode, num_threads=threads), lambda: mge.PuzzleEnv(task)
    )


def test_a_vector_stepped_on_threads_equals_single_environments(noisy):
    def many(n, mode):
        return mge.PuzzleVectorEnv(noisy, n, mode, num_threads=3)

    check_vector(many, lambda: mge.PuzzleEnv(noisy), num_envs=150, steps=40)


def test_gymnasium_makes_vectors_by_name(noisy):
    envs = gymnasium.make_vec("mge/task1-v0", num_envs=3, autoreset_mode="SameStep")
    assert isinstance(envs, mge.PuzzleVectorEnv) and envs.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    assert envs.spec.id == "mge/task1-v0" and "PuzzleVectorEnv(mge/task1-v0, num_envs=3)" in repr(envs)
    by_file = gymnasium.make_vec("mge/Task-v0", num_envs=2, task=noisy)
    assert by_file.task.name == "noisy"
    first, _ = by_file.reset(seed=4)
    assert not (first[0] == first[1]).all(), "each environment has its own seed"
    wrapped = gymnasium.wrappers.vector.RecordEpisodeStatistics(envs)
    wrapped.reset(seed=0)
    seen = [wrapped.step(wrapped.action_space.sample())[4] for _ in range(60)]
    assert any("episode" in infos for infos in seen)


def test_processes_of_gymnasium_step_the_same_episodes():
    def make():
        return mge.PuzzleEnv("task2")

    ours = mge.PuzzleVectorEnv("task2", 2)
    theirs = gymnasium.vector.AsyncVectorEnv([make, make])
    try:
        assert (ours.reset(seed=5)[0] == theirs.reset(seed=5)[0]).all()
        ours.action_space.seed(0)
        for _ in range(20):
            actions = ours.action_space.sample()
            assert (ours.step(actions)[0] == theirs.step(actions)[0]).all()
    finally:
        theirs.close()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
@pytest.mark.filterwarnings("ignore:.*fork.*")
def test_a_forked_process_gets_its_own_threads():
    envs = mge.PuzzleVectorEnv(num_envs=200, num_threads=2)
    envs.reset(seed=0)
    envs.step(np.zeros((200, 2), np.float32))
    child = os.fork()
    if child == 0:
        envs.step(np.zeros((200, 2), np.float32))
        os._exit(7)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7


def test_without_copies_one_array_is_overwritten():
    envs = mge.PuzzleVectorEnv(num_envs=4, copy=False)
    first, _ = envs.reset(seed=0)
    start = first.copy()
    second = envs.step(envs.action_space.sample())[0]
    assert second is first and not (first == start).all()
    observations = mge.PuzzleVectorEnv(num_envs=4, copy=False).reset(seed=0)[0]
    observations.flags.writeable = False
    assert (observations == start).all()


def test_success_is_known():
    """Some random action sequence reaches the goal of task 1."""
    envs = mge.PuzzleVectorEnv(num_envs=512, autoreset_mode="SameStep")
    envs.reset(seed=0)
    envs.action_space.seed(0)
    goals = 0
    for _ in range(60):
        _, rewards, terminated, _, infos = envs.step(envs.action_space.sample())
        if "final_info" in infos:
            final = infos["final_info"]
            goals += final["is_success"].sum()
            assert (final["end"][final["is_success"]] == "goal").all()
            assert terminated[final["is_success"]].all() and (rewards[final["is_success"]] > 5).all()
    assert goals > 0


def test_restored_states_with_tools_continue_as_the_original():
    envs, others = (mge.PuzzleVectorEnv("create/Moving-random", 3, tools="all") for _ in range(2))
    envs.reset(seed=3)
    envs.action_space.seed(1)
    for _ in range(30):
        others.set_state(pickle.loads(pickle.dumps(envs.get_state())))
        action = envs.action_space.sample()
        got, expected = others.step(action), envs.step(action)
        assert got[0].tobytes() == expected[0].tobytes() and (got[4]["tools"] == expected[4]["tools"]).all()


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_restored_states_continue_as_the_original(mode, noisy):
    envs, others = (mge.PuzzleVectorEnv(noisy, 6, mode) for _ in range(2))
    envs.reset(seed=3)
    envs.action_space.seed(1)
    for _ in range(5):
        envs.step(envs.action_space.sample())
    state = envs.get_state()
    for saved in (state, pickle.loads(pickle.dumps(state)), copy.deepcopy(state)):
        observations = others.set_state(saved)
        actions = np.random.default_rng(0)
        envs.set_state(state)
        for _ in range(4):
            action = actions.uniform(-1, 1, (6, 2)).astype(np.float32)
            got, expected = others.step(action), envs.step(action)
            assert got[0].tobytes() == expected[0].tobytes() and (got[1] == expected[1]).all()
    assert len(state) == 6 and state.balls.shape == (6, 5) and len(state[-1]) == 1
    # One state for several environments, as a search uses it.
    observations = others.set_state(state[2], [0, 4])
    assert (observations[0] == observations[4]).all()
    one = mge.PuzzleEnv(noisy)
    observation, info = one.set_state(state[2])
    assert (observation == observations[0]).all() and not info["is_success"]
    assert (one.get_state().balls == state.balls[2:3]).all()


def test_misuse_of_states_is_reported(noisy):
    envs = mge.PuzzleVectorEnv(num_envs=3)
    envs.reset(seed=0)
    with pytest.raises(ValueError, match="of task `task1` with .*, but the environment plays `noisy`"):
        mge.PuzzleVectorEnv(noisy, 3).set_state(envs.get_state())
    with pytest.raises(ValueError, match="3 states cannot be those of 2"):
        envs.set_state(envs.get_state(), [0, 1])
    with pytest.raises(IndexError, match="no environment 3"):
        envs.get_state([3])
    with pytest.raises(IndexError, match="no state 3"):
        envs.get_state()[3]
    with pytest.raises(ValueError, match="3 states cannot be those of 1"):
        mge.PuzzleEnv().set_state(envs.get_state())


@pytest.mark.filterwarnings("ignore:.*infinity.*")
def test_parts_of_observations_are_chosen_by_name():
    check_env(mge.PuzzleEnv("create/Push", tools="train", observation=["tools", "progress"]), skip_render_check=True)

    def many(n, mode):
        return mge.PuzzleVectorEnv("task2", n, mode, num_threads=2, observation=["stage", "vector"])

    # Enough environments for several threads, and steps during which episodes end.
    check_vector(many, lambda: mge.PuzzleEnv("task2", observation=["stage", "vector"]), num_envs=70, steps=40)
    envs = mge.PuzzleVectorEnv("task2", 3, observation="objects", copy=False)
    first, _ = envs.reset(seed=0)
    start = first.copy()
    assert np.shares_memory(envs.step(np.full((3, 2), 0.9))[0], first) and (first != start).any()
    state = envs.get_state()
    envs.reset(seed=1)
    assert (envs.set_state(state) == first).all()
    with pytest.raises(ValueError, match="names nothing"):
        mge.PuzzleEnv(observation=[])


def test_rendering_shows_what_moves_besides_the_target():
    env = mge.PuzzleEnv("create/Moving", tools="train", render_mode="rgb_array", render_size=(200, 200))
    env.reset(seed=0)
    first = env.render()
    env.step([0, 0.0, 0.0])  # the no-op
    changed = (env.render() != first).any(axis=2)
    assert changed[40:, 100:].any(), "the target falls on the right"
    assert changed[40:, :100].any(), "the goal, a ball, falls on the left"


def test_rendering():
    env = mge.PuzzleEnv(render_mode="rgb_array", render_size=(200, 160))
    env.reset(seed=0)
    first = env.render()
    assert first.shape == (160, 200, 3) and first.dtype == np.uint8
    env.step(np.array([0.9, -0.9], np.float32))
    assert (env.render() != first).any()
    envs = mge.PuzzleVectorEnv(num_envs=2, render_mode="rgb_array", render_size=(200, 160))
    envs.reset(seed=0)
    images = envs.render()
    assert len(images) == 2 and (images[0] == first).all()
    with pytest.raises(ValueError, match="size"):
        broken = mge.PuzzleEnv(render_mode="rgb_array", render_size=(0, 10))
        broken.reset(seed=0)
        broken.render()
    with pytest.raises(ValueError, match="human"):
        mge.PuzzleEnv(render_mode="human")


WRONG_ACTIONS = [
    (np.zeros((3, 2), np.float32), ValueError, r"shape \(3, 2\), and should have \(4, 2\)"),
    (np.zeros(8, np.float32), ValueError, "shape"),
    (np.zeros((4, 3), np.float32), ValueError, "shape"),
    (np.zeros((4, 2), complex), TypeError, "complex128"),
    (np.zeros((4, 2), bool), TypeError, "bool"),
    (np.full((4, 2), "a"), TypeError, "numbers"),
    (np.full((4, 2), None), TypeError, "object"),
    (None, ValueError, "shape"),
    (np.array([[0, 0], [0, np.nan], [0, 0], [0, 0]]), ValueError, "environment 1 .*NaN"),
    (np.array([[0, 0], [0, 0], [0, 0], [np.inf, 0]], np.float32), ValueError, "environment 3 .*inf"),
    (np.full((4, 2), 1e300), ValueError, "environment 0 .*inf"),
]


@pytest.mark.filterwarnings("ignore:overflow")
@pytest.mark.parametrize(("actions", "error", "message"), WRONG_ACTIONS)
def test_wrong_actions_are_said_and_change_nothing(actions, error, message):
    envs = mge.PuzzleVectorEnv(num_envs=4)
    envs.reset(seed=0)
    before = pickle.dumps(envs.get_state())
    with pytest.raises(error, match=message):
        envs.step(actions)
    assert pickle.dumps(envs.get_state()) == before


@pytest.mark.parametrize("kind", [np.float64, np.float16, np.int8, np.uint32])
def test_numbers_of_any_type_and_layout_are_actions(kind):
    def step(actions):
        envs = mge.PuzzleVectorEnv(num_envs=4)
        envs.reset(seed=0)
        return envs.step(actions)[0]

    actions = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], kind)
    expected = step(actions.astype(np.float32))
    assert (step(actions) == expected).all()
    assert (step(np.asfortranarray(actions)) == expected).all()
    assert (step(np.repeat(actions, 2, axis=0)[::2]) == expected).all()
    assert (step(actions.tolist()) == expected).all()


def test_misuse_raises_exceptions_that_say_what_to_do():
    envs = mge.PuzzleVectorEnv(num_envs=2, autoreset_mode="Disabled")
    with pytest.raises(ResetNeeded, match="has not begun: reset"):
        envs.step(np.zeros((2, 2)))
    with pytest.raises(ResetNeeded, match="environment 1 has not begun"):
        envs.reset(options={"reset_mask": np.array([True, False])})
        envs.step(np.zeros((2, 2)))
    envs.reset(seed=0)
    with pytest.raises(ResetNeeded, match="the episode of environment 0 is over: reset"):
        for _ in range(100):
            envs.step(np.full((2, 2), 0.9))
    env = mge.PuzzleEnv()
    with pytest.raises(ResetNeeded, match="reset that environment before"):
        env.step(np.zeros(2))
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"shape \(3,\)"):
        env.step(np.zeros(3))
    env.close()
    env.close()
    for use in (env.reset, lambda: env.step(np.zeros(2)), env.get_state):
        with pytest.raises(ClosedEnvironmentError, match="closed"):
            use()
    for mask, error in [
        ([True, False], TypeError),
        (np.zeros(2), TypeError),
        (np.ones(3, bool), ValueError),
        (np.zeros(2, bool), ValueError),
    ]:
        with pytest.raises(error, match="reset_mask"):
            envs.reset(options={"reset_mask": mask})
    for seed in (-1, 2**64):
        with pytest.raises(ValueError, match="seed"):
            envs.reset(seed=seed)
    with pytest.raises(ValueError, match="3 seeds for 2 environments"):
        envs.reset(seed=[1, 2, 3])
    for arguments in ({"num_envs": 0}, {"num_envs": 2, "num_threads": 0}):
        with pytest.raises(ValueError, match="is 0, and should be from 1"):
            mge.PuzzleVectorEnv(**arguments)
    with pytest.raises(ValueError, match="Sometimes"):
        mge.PuzzleVectorEnv(num_envs=2, autoreset_mode="Sometimes")
    with pytest.raises(ValueError, match="no task `task9`.*did you mean"):
        mge.PuzzleEnv("task9")
    with pytest.raises(ValueError, match="nowhere does not exist"):
        mge.read_run("nowhere")
    with pytest.raises(TypeError):
        mge.PuzzleVectorEnv(num_envs=2, task=3)


def test_two_threads_may_not_step_one_environment_at_once():
    from concurrent.futures import ThreadPoolExecutor

    envs = mge.PuzzleVectorEnv(num_envs=2000, num_threads=1)
    envs.reset(seed=0)
    actions = envs.action_space.sample()

    def step(_):
        try:
            envs.step(actions)
        except RuntimeError as error:
            return str(error)
        return "stepped"

    with ThreadPoolExecutor(2) as threads:
        said = set(threads.map(step, range(20)))
    assert "stepped" in said and all("another thread" in one for one in said - {"stepped"}), said
