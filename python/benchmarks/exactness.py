"""How closely this program, and CREATE itself when replayed, follow recorded episodes of CREATE.

    python python/benchmarks/exactness.py EPISODES LEVELS TOOLS --create FOLDER [--program mge]

EPISODES, LEVELS and TOOLS are JSON Lines in the format of `mge play`; tests/data/create/all has some, compressed with
gzip. FOLDER is a clone of CREATE's repository, which needs gym 0.21, pymunk 5.7.0 (the wheel for Linux, as the
recordings), pygame, pillow and opencv-python.
Prints Markdown: for each level the number of episodes in which the target ball leaves the recorded path by more than
rounding, and the share of actions with the recorded outcome.
"""

import argparse
import json
import os
import subprocess
import sys

import numpy as np

# Recordings have five decimals.
ROUNDING = 3e-5


def lines(path):
    with open(path) as file:
        return [record for record in map(json.loads, file) if "steps" in record]


def ours(options):
    """The steps of every episode: outcome and position of the target."""
    with open(options.episodes) as file:
        command = [options.program, "play", "--levels", options.levels, "--tools", options.tools]
        output = subprocess.run(command, stdin=file, capture_output=True, text=True, check=True).stdout
    played = map(json.loads, output.splitlines())
    return {it["id"]: [(step["outcome"], step["balls"]["target"][:2]) for step in it["steps"]] for it in played}


def theirs(folder, records):
    """The same for a replay in CREATE."""
    os.environ["SDL_VIDEODRIVER"] = "dummy"
    sys.path.insert(0, folder)
    for name, kind in (("bool", bool), ("float", float), ("int", int)):
        # Aliases that newer NumPy versions have removed.
        if name not in vars(np):
            setattr(np, name, kind)
    import create_game  # registers its levels
    import gym

    # Freeing a pymunk space while others are in use can crash the interpreter.
    kept = []
    for record in records:
        env = gym.make(f"CreateLevel{record['level']}_Det-v0").unwrapped
        kept.append(env)
        env.set_settings(create_game.settings.CreateGameSettings())
        env.render = lambda *_, **__: None
        env.reset()
        env.inventory = np.array(record["inventory"])
        steps = []
        for step in record["steps"]:
            before = len(env.placed_tools), env.no_op_count
            # Places are in single precision: in double precision they differ, and so do the paths in the end.
            action = np.array(step["action"], np.float32)
            is_overlap = bool(env.placed_tools) and env.check_overlap(np.clip(action[1:], -1, 1))
            done = env.step(action)[2]
            after = len(env.placed_tools), env.no_op_count
            missed = "no_op" if after[1] > before[1] else "overlap" if is_overlap else "collision"
            steps.append(("placed" if after[0] > before[0] else missed, list(env.target_obj.shape.body.position)))
            if done:
                break
        yield record["id"], steps


def compared(record, steps):
    """Whether the target leaves its recorded path, and how many outcomes agree."""
    pairs = list(zip(record["steps"], steps))
    leaves = any(abs(x - y) > ROUNDING for step, (_, at) in pairs for x, y in zip(step["balls"]["target"], at))
    return leaves, sum(step["outcome"] == outcome for step, (outcome, _) in pairs)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("episodes")
    parser.add_argument("levels")
    parser.add_argument("tools")
    parser.add_argument("--create", required=True, metavar="FOLDER", help="a clone of CREATE's repository")
    parser.add_argument("--program", default="mge")
    options = parser.parse_args()
    records = lines(options.episodes)
    played = [ours(options), dict(theirs(options.create, records))]
    print("| level | episodes | mge leaves the path in | CREATE, replayed, in | recorded outcomes: mge | CREATE |")
    print("|---|--:|--:|--:|--:|--:|")
    levels = sorted({record["level"] for record in records})
    for level in [*levels, None]:
        mine = [record for record in records if level in (None, record["level"])]
        actions = sum(len(record["steps"]) for record in mine)
        both = [[compared(record, steps[record["id"]]) for record in mine] for steps in played]
        leaves = [sum(leaves for leaves, _ in results) for results in both]
        alike = [sum(alike for _, alike in results) / actions for results in both]
        name = level or "all"
        print(f"| {name} | {len(mine)} | {leaves[0]} | {leaves[1]} | {alike[0]:.3f} | {alike[1]:.3f} |")


if __name__ == "__main__":
    main()
