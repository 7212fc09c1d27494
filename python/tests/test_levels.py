"""The shipped levels of CREATE are its level files, converted by `python/tools/create_level.py`."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

import mge

ROOT = Path(__file__).parents[2]
LEVELS = sorted((ROOT / "tests" / "data" / "create" / "levels").glob("*.json"))


@pytest.mark.parametrize("path", LEVELS, ids=lambda path: path.stem)
def test_a_level_is_that_of_create(path):
    converter = ROOT / "python" / "tools" / "create_level.py"
    task = subprocess.run([sys.executable, converter, path], capture_output=True, text=True, check=True).stdout
    assert mge.Task.parse(task) == mge.Task(f"create/{json.loads(path.read_text())['name']}-random")


def test_every_level_has_its_file():
    assert len(LEVELS) == len(mge.level_names())
