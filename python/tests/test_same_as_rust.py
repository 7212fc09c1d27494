"""A thousand random episodes equal those of the Rust environment, to the bit."""

import json
import subprocess

import numpy as np
import pytest

import mge

EPISODES_PER_TASK = 100


def served(program, task, seed, actions, episodes, tools=None):
    """Episodes of `mge env serve`: for each, the steps (observation, reward, terminated, truncated) and the tools.
    They consume the actions in order: a place, preceded by an index if there are tools."""
    requests = [{"command": "reset", "seed": seed}]
    command = [program, "env", "serve", task, *([] if tools is None else ["--tools", tools])]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)

    def ask(request):
        process.stdin.write(json.dumps(request) + "\n")
        process.stdin.flush()
        answer = json.loads(process.stdout.readline())
        assert "error" not in answer, answer
        return answer

    played, turn = [], iter(actions)
    for episode in range(episodes):
        answer = ask(requests[0] if episode == 0 else {"command": "reset"})
        inventory = answer.get("tools")
        steps = [(answer["observation"], 0.0, False, False)]
        while not (steps[-1][2] or steps[-1][3]):
            *index, x, y = next(turn)
            request = {"command": "step", "action": [float(x), float(y)]}
            answer = ask(request | {"tool": int(part) for part in index})
            steps.append((answer["observation"], answer["reward"], answer["terminated"], answer["truncated"]))
        played.append((steps, inventory))
    ask({"command": "close"})
    process.wait(timeout=10)
    process.stdin.close()
    process.stdout.close()
    return played


def noisy(name, folder):
    task = json.loads(mge.Task(name).to_json())
    task["rules"]["start_noise"] = 0.05
    path = folder / f"{name}-noisy.json"
    path.write_text(json.dumps(task))
    return str(path)


@pytest.mark.parametrize("name", [*mge.task_names(), *(f"{name}, noisy" for name in mge.task_names()[:4])])
def test_episodes_are_those_of_the_rust_environment(program, name, tmp_path):
    task = noisy(name.split(",")[0], tmp_path) if "noisy" in name else name
    seed = 1000
    actions = np.random.default_rng(7).uniform(-1, 1, (EPISODES_PER_TASK * 60, 2)).astype(np.float32)
    expected = served(program, task, seed, actions, EPISODES_PER_TASK)
    compare(mge.PuzzleVectorEnv(task, 1), seed, actions, expected)


@pytest.mark.parametrize("level", mge.level_names())
@pytest.mark.parametrize("variant", ["", "-random"])
def test_episodes_with_tools_are_those_of_the_rust_environment(program, level, variant):
    task, seed, episodes = f"create/{level}{variant}", 500, 5
    random = np.random.default_rng(8)
    actions = np.column_stack([random.integers(0, 40, episodes * 60), random.uniform(-1, 1, (episodes * 60, 2))])
    actions = actions.astype(np.float32)
    for tools in ("train", "test"):
        expected = served(program, task, seed, actions, episodes, tools)
        compare(mge.PuzzleVectorEnv(task, 1, tools=tools), seed, actions, expected)


def compare(vector, seed, actions, expected):
    turn = iter(actions)
    observations, infos = vector.reset(seed=seed)
    for number, (steps, inventory) in enumerate(expected):
        if number > 0:
            # The step after the end begins the next episode and ignores the action.
            observations, rewards, terminated, truncated, infos = vector.step(np.zeros((1, actions.shape[1])))
            assert (rewards[0], terminated[0], truncated[0]) == (0, False, False)
        if inventory is not None:
            assert infos["tools"][0].tolist() == inventory
        for place, (observation, reward, terminated, truncated) in enumerate(steps):
            where = f"episode {number}, step {place}"
            if place > 0:
                observations, rewards, ended, cut, _ = vector.step(next(turn)[None])
                assert np.float32(rewards[0]) == np.float32(reward), where
                assert (ended[0], cut[0]) == (terminated, truncated), where
            assert observations[0].tobytes() == np.array(observation, np.float32).tobytes(), where
