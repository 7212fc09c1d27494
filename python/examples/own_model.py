"""A custom dynamics model in NumPy: a ball that bounces off discs."""

import numpy as np


class Bounces:
    interval = 5  # physics steps of 1/30 s

    def advance(self, balls, tools):
        """Returns the balls (x, y, velocity x, y, spin) 5/30 s later among tools (type, x, y, size, ...)."""
        balls, dt = balls.copy(), 1 / 30
        places, sizes = tools[:, :, 1:3] * 42, tools[:, :, 3] / 2  # the screen is 84 units wide
        for _ in range(self.interval):
            balls[:, 3] -= 2.0 * dt
            balls[:, :2] += balls[:, 2:4] * dt / 42
            away = balls[:, None, :2] * 42 - places
            distance = np.linalg.norm(away, axis=2)
            normal = away / np.maximum(distance, 1e-6)[:, :, None]
            into = (balls[:, None, 2:4] * normal).sum(axis=2)
            hit = (distance < sizes + 4) & (into < 0)  # NaN (no tool) is never a hit
            balls[:, 2:4] -= np.where(hit[:, :, None], 1.5 * into[:, :, None] * normal, 0).sum(axis=1)
        return balls
