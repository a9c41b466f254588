"""Robots of a fleet exchange their places: where each starts and where it is to go, drawn by a seed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fulmar_core.config.errors import ConfigError

SWAP_PLACES = "swap_places"
AREA_M = 4.0  # side of the square that the places lie in, for four robots of 0.31 m; it grows with robots and hulls
APART_M = 0.6  # between the hulls of robots that stand at two places
TRIES = 10_000


def swap_places(seed: int, radii: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Draw places, and let each robot go to the place of the next one in a random round.

    Args:
        seed: >= 0.
        radii: Of the circle around each robot [m].

    Returns:
        Starts and goals, each shape (n, 3): x, y [m], heading [rad].

    Raises:
        ConfigError: Fewer than two robots.
    """
    count = len(radii)
    if count < 2:
        raise ConfigError(f"'{SWAP_PLACES}' needs at least two robots, and the fleet has {count}.")
    draws, largest = np.random.default_rng(seed), max(radii)
    side = AREA_M * max(1.0, np.sqrt(count / 4.0) * (2.0 * largest + APART_M) / 1.22)
    places = _places(draws, count, side, 2.0 * largest + APART_M)
    headings = draws.uniform(-np.pi, np.pi, size=(2, count))
    order = draws.permutation(count)
    after = np.empty(count, dtype=int)
    after[order] = np.roll(order, -1)
    starts = np.column_stack((places, headings[0]))
    return starts, np.column_stack((places[after], headings[1]))


def _places(draws: np.random.Generator, count: int, side: float, apart: float) -> np.ndarray:
    """Places in a square about the origin, shape (count, 2) [m], no two of them nearer than that [m]."""
    found: list[np.ndarray] = []
    for _ in range(TRIES):
        place = draws.uniform(-0.5 * side, 0.5 * side, size=2)
        if all(np.linalg.norm(place - other) >= apart for other in found):
            found.append(place)
        if len(found) == count:
            return np.array(found)
    return _places(draws, count, 1.2 * side, apart)  # such a crowd needs more room
