"""What the tests share."""

import os
import subprocess

import pytest


@pytest.fixture(scope="session")
def program():
    """The program `mge`, named by the variable `MGE_PROGRAM`."""
    path = os.environ.get("MGE_PROGRAM")
    if path is None:
        pytest.skip("set MGE_PROGRAM to the program `mge`")
    return path


@pytest.fixture(scope="session")
def run(program, tmp_path_factory):
    """A short run that learned something, with clusters."""
    folder = tmp_path_factory.mktemp("runs")
    for seed in (0, 1):
        settings = ["ddpg.warmup_steps=50", "ddpg.hidden=16", "evaluation.every=10"]
        command = [program, "train", "task1", "--episodes", "40", "--seed", str(seed), "--quiet"]
        command += ["--out", str(folder / f"seed{seed}")]
        for setting in settings:
            command += ["--set", setting]
        subprocess.run(command, check=True, capture_output=True)
    return folder / "seed0"
