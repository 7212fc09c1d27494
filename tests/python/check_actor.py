"""Runs the NumPy snippet of docs/python.md on an exported actor and compares its actions with ours.

    mge export RUN --out actor.safetensors
    mge evaluate RUN --observations > episodes.jsonl
    python tests/python/check_actor.py FOLDER

FOLDER holds the two files; the snippet is the block of Python in docs/python.md.
"""

import json
import os
import re
import sys
from pathlib import Path

import numpy as np

PAGE = Path(__file__).parents[2] / "docs" / "python.md"


def main(folder):
    [snippet] = re.findall(r"```python numpy\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert len(snippet.splitlines()) <= 20, "the snippet is longer than 20 lines"
    os.chdir(folder)
    names = {}
    exec(snippet, names)
    compared, worst = 0, 0.0
    for line in Path("episodes.jsonl").read_text().splitlines():
        episode = json.loads(line)
        ours = np.array(episode["actions"])
        theirs = np.stack([names["act"](observation) for observation in episode["observations"]])
        assert ours.shape == theirs.shape and ours.size > 0
        compared, worst = compared + len(ours), max(worst, np.abs(ours - theirs).max())
    assert worst <= 1e-6, f"actions differ by {worst}"
    print(f"{compared} actions agree to {worst:.1e}")


if __name__ == "__main__":
    main(sys.argv[1])
