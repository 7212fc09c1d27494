"""Shared fixtures."""

import os
import subprocess

import pytest


@pytest.fixture(scope="session")
def program():
    """The path of the program `mge`, from `MGE_PROGRAM`."""
    path = os.environ.get("MGE_PROGRAM")
    if path is None:
        pytest.skip("set MGE_PROGRAM to the program `mge`")
    return path


def train(program, folder, *arguments):
    """Trains a small agent on task1 for 40 episodes."""
    settings = ["ddpg.warmup_steps=50", "ddpg.hidden=16", "evaluation.every=10"]
    command = [program, "train", "task1", "--episodes", "40", "--quiet", "--out", str(folder), *arguments]
    for setting in settings:
        command += ["--set", setting]
    subprocess.run(command, check=True, capture_output=True)
    return folder


@pytest.fixture(scope="session")
def run(program, tmp_path_factory):
    """A short trained run with clusters and actions relative to the ball; its folder has two seeds."""
    folder = tmp_path_factory.mktemp("runs")
    return [train(program, folder / f"seed{seed}", "--seed", str(seed)) for seed in (0, 1)][0]


@pytest.fixture(scope="session")
def plain(program, tmp_path_factory):
    """A short run of the paper's method."""
    return train(program, tmp_path_factory.mktemp("plain") / "seed0", "--method", "ddpg-mge")
