"""The programs of docs/python.md: the page shows them verbatim, and they run."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "python" / "examples"


def test_the_page_shows_the_programs():
    shown = re.findall(r"```python\n(\"\"\".*?)```", (ROOT / "docs" / "python.md").read_text(), re.DOTALL)
    assert sorted(shown) == sorted(path.read_text() for path in EXAMPLES.glob("*.py"))


@pytest.mark.parametrize(
    ("arguments", "needs"),
    [
        (["random_search.py", "task1", "40"], "mge"),
        (["ddpg.py", "600"], "stable_baselines3"),
        (["ddpg.py", "600", "--own-model"], "stable_baselines3"),
    ],
)
def test_programs_run(arguments, needs):
    pytest.importorskip(needs)
    command = [sys.executable, EXAMPLES / arguments[0], *arguments[1:]]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert re.search(r"goal|success", done.stdout)
