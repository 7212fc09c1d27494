"""The tasks of MGE Workbench as Gymnasium environments.

    env = MgeEnv("task1")                    # needs the program `mge` on the PATH
    env = MgeEnv("my.json", program=["/path/to/mge"])

The environment runs in a process of its own (`mge env serve`) and is closed with `close()`.
"""

import json
import subprocess

import gymnasium
import numpy as np


class MgeEnv(gymnasium.Env):
    """A task: place one tool every 1.33 seconds so that the ball reaches the goal."""

    metadata = {"render_modes": []}

    def __init__(self, task="task1", program=("mge",), render_mode=None):
        if render_mode is not None:
            raise ValueError("this environment has no render modes")
        self.render_mode = None
        command = [*program, "env", "serve", task]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
        spaces = self._ask(command="spaces")
        self.observation_space = self._box(spaces["observation_space"])
        self.action_space = self._box(spaces["action_space"])

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        request = {"command": "reset"} if seed is None else {"command": "reset", "seed": int(seed)}
        answer = self._ask(**request)
        return self._observation(answer), answer["info"]

    def step(self, action):
        action = [float(value) for value in np.asarray(action).reshape(-1)]
        answer = self._ask(command="step", action=action)
        return self._observation(answer), answer["reward"], answer["terminated"], answer["truncated"], answer["info"]

    def close(self):
        if self._process.poll() is None:
            self._ask(command="close")
        self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait()

    def _ask(self, **request):
        try:
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        except (BrokenPipeError, ValueError):
            line = ""
        if not line:
            raise RuntimeError("the environment has ended: see its message on standard error")
        answer = json.loads(line)
        if "error" in answer:
            raise ValueError(answer["error"])
        return answer

    @staticmethod
    def _observation(answer):
        return np.array(answer["observation"], dtype=np.float32)

    @staticmethod
    def _box(space):
        low, high = (
            np.array([default if bound is None else bound for bound in space[name]], dtype=np.float32)
            for name, default in (("low", -np.inf), ("high", np.inf))
        )
        return gymnasium.spaces.Box(low, high, tuple(space["shape"]), np.float32)
