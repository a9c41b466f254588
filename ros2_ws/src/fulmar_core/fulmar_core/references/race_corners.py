"""Corners of race tracks at random: closed, driven counter-clockwise, never crossing themselves."""

from __future__ import annotations

import math

import numpy as np

from fulmar_core.counter_rng import Draws

INNER = 0.4  # nearest that a corner comes to the middle, as a share of the farthest: our value
JITTER = 0.25  # how far a corner's bearing strays from even spacing, as a share of it: our value


def draw_corners(draws: Draws, *, fewest: int, most: int, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Draw corners at growing bearings around a middle, each at a distance of its own.

    The track turns by no more than 150° anywhere, for 9 to 13 corners, which keeps RoboRAN's rule of at least 12.5°
    between the ways in and out (tasks_cfg/race_waypoints_cfg.py) without drawing again.

    Args:
        draws: One row for each track; as many numbers are drawn whatever comes out.
        fewest: Corners, >= 3.
        most: Corners, >= `fewest`.
        size: Side of the square that a track fits into [m].

    Returns:
        Corners about the origin, shape (worlds, most, 2) [m], and how many of each row are meant, shape (worlds,).
    """
    count = np.floor(np.asarray(draws.uniform(fewest, most + 1.0))).astype(int)
    radius = 0.5 * size * np.asarray(draws.uniform(INNER, 1.0, most))
    stray = np.asarray(draws.uniform(-JITTER, JITTER, most))
    first = np.asarray(draws.uniform(-math.pi, math.pi))
    bearing = first[:, None] + 2.0 * math.pi / count[:, None] * (np.arange(most) + stray)
    return radius[..., None] * np.stack((np.cos(bearing), np.sin(bearing)), axis=-1), count
