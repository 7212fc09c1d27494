"""The programs of docs/python.md: the page shows them verbatim, and they run."""

import os
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
        (["ddpg.py", "600", "--guided"], "stable_baselines3"),
        (["log_to_wandb.py", "40"], "mge"),
        (["search_with_optuna.py", "20"], "mge"),
    ],
)
def test_programs_run(arguments, needs, tmp_path):
    pytest.importorskip(needs)
    command = [sys.executable, EXAMPLES / arguments[0], *arguments[1:]]
    # What W&B and Optuna are given is seen by objects that stand in for them.
    paths = [str(Path(__file__).parent / "stand_ins"), os.environ.get("PYTHONPATH", "")]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, cwd=tmp_path, env=env)
    assert done.returncode == 0, done.stderr
    assert re.search(r"goal|success", done.stdout)
    if arguments[0] == "log_to_wandb.py":
        assert "mge 40 ['eval/episode', 'eval/episodes', 'eval/mean_return', 'eval/success'" in done.stdout
    if arguments[0] == "search_with_optuna.py":
        assert "pruned trial 1" in done.stdout and len(list((tmp_path / "runs").iterdir())) == 2
