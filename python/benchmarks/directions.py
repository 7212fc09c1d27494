"""The cosines and sines with which CREATE places its tools, as NumPy computes them.

    python python/benchmarks/directions.py assets/create/directions.csv --create FOLDER

CREATE computes the corners of its tools with NumPy, whose sine and cosine on processors with AVX-512 are often one or
two units in the last place away from the nearest number. FOLDER is a clone of CREATE's repository, as for
exactness.py; the recordings were made with NumPy 1.23. Builds every tool of the catalogue and every level and writes
each angle with its cosine and sine.
"""

import argparse
import os
import sys

import numpy as np


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("output")
    parser.add_argument("--create", required=True, metavar="FOLDER", help="a clone of CREATE's repository")
    options = parser.parse_args()
    os.environ["SDL_VIDEODRIVER"] = "dummy"
    sys.path.insert(0, options.create)
    for name, kind in (("bool", bool), ("float", float), ("int", int)):
        # Aliases that newer NumPy versions have removed.
        if name not in vars(np):
            setattr(np, name, kind)
    cosine, sine = np.cos, np.sin
    angles = set()

    def noted(function):
        return lambda angle: angles.add(float(angle)) or function(angle)

    np.cos, np.sin = noted(cosine), noted(sine)
    import create_game  # registers its levels
    import gym
    import pygame

    pygame.display.set_mode((84, 84))  # tools with a picture need one
    settings = create_game.CreateGameSettings()
    generator = create_game.ToolGenerator(settings.gran_factor)
    for number in range(len(generator.tools)):
        generator.get_tool(number, (0.0, 0.0), settings)
    kept = []
    for level in sorted(name for name in gym.envs.registry.env_specs if name.startswith("CreateLevel") and "_Det" in name):
        # Freeing a pymunk space while others are in use can crash the interpreter.
        kept.append(gym.make(level).unwrapped)
        kept[-1].set_settings(settings)
        kept[-1].render = lambda *_, **__: None
        kept[-1].reset()
    with open(options.output, "w") as file:
        file.write("angle,cos,sin\n")
        for angle in sorted(angles):
            file.write(f"{angle!r},{float(cosine(angle))!r},{float(sine(angle))!r}\n")


if __name__ == "__main__":
    main()
