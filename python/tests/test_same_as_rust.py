"""A thousand random episodes are those of the Rust environment, to the bit."""

import json
import subprocess

import numpy as np
import pytest

import mge

EPISODES_PER_TASK = 100


def served(program, task, seed, actions, episodes):
    """Episodes of `mge env serve` as lists of observations, rewards and ends; each takes the actions
    in turn."""
    requests = [{"command": "reset", "seed": seed}]
    process = subprocess.Popen(
        [program, "env", "serve", task], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    )

    def ask(request):
        process.stdin.write(json.dumps(request) + "\n")
        process.stdin.flush()
        answer = json.loads(process.stdout.readline())
        assert "error" not in answer, answer
        return answer

    played, turn = [], iter(actions)
    for episode in range(episodes):
        answer = ask(requests[0] if episode == 0 else {"command": "reset"})
        steps = [(answer["observation"], 0.0, False, False)]
        while not (steps[-1][2] or steps[-1][3]):
            answer = ask({"command": "step", "action": [float(value) for value in next(turn)]})
            steps.append((answer["observation"], answer["reward"], answer["terminated"], answer["truncated"]))
        played.append(steps)
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
    vector = mge.PuzzleVectorEnv(1, task)
    turn = iter(actions)
    observations, _ = vector.reset(seed=seed)
    for number, steps in enumerate(expected):
        if number > 0:
            # The step after the end begins the next episode and ignores its action.
            observations, rewards, terminated, truncated, _ = vector.step(np.zeros((1, 2)))
            assert (rewards[0], terminated[0], truncated[0]) == (0, False, False)
        for place, (observation, reward, terminated, truncated) in enumerate(steps):
            where = f"episode {number}, step {place}"
            if place > 0:
                observations, rewards, ended, cut, _ = vector.step(next(turn)[None])
                assert np.float32(rewards[0]) == np.float32(reward), where
                assert (ended[0], cut[0]) == (terminated, truncated), where
            assert observations[0].tobytes() == np.array(observation, np.float32).tobytes(), where
