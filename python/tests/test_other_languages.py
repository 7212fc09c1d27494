"""The example of `mge env serve` in another language."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[2] / "assets" / "examples" / "random-search.mjs"


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no Node")
def test_the_example_in_javascript_plays(program):
    environment = {**os.environ, "MGE": program}
    said = subprocess.run(["node", str(EXAMPLE), "task1", "20"], env=environment, capture_output=True, text=True, timeout=60)
    assert said.returncode == 0, said.stderr
    assert re.search(r"\d+ of 20 random episodes of task1 reached the goal\nthe best return is -?\d", said.stdout)
