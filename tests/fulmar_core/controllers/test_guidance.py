"""What is free ahead among discs."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.controllers.guidance import CREEP, room_ahead

WIDE = 0.5


def room(*discs, course=0.0):
    """Free distance for discs at (x, y)."""
    x, y = (np.array([disc[axis] for disc in discs], dtype=float) for axis in (0, 1))
    return float(room_ahead((x, y, WIDE), np.asarray(course)))


def test_room_is_what_is_free_in_the_direction_of_travel():
    assert room((2.0, 0.0), (1.0, 3.0)) == pytest.approx(2.0 - WIDE)
    assert room((2.0, 0.0), course=np.pi) == np.inf
    assert room((2.0, 0.51)) == np.inf
    assert room((0.0, 2.0), course=0.5 * np.pi) == pytest.approx(2.0 - WIDE)


def test_who_stands_at_an_obstacle_may_still_creep():
    assert room((0.3, 0.0)) == CREEP


def test_a_batch_is_answered_like_its_members():
    rng = np.random.default_rng(5)
    course, (x, y) = 3.0 * rng.normal(size=40), 2.0 * rng.normal(size=(2, 40, 3))
    together = room_ahead((x, y, WIDE), course)
    for i in range(40):
        assert float(room_ahead((x[i], y[i], WIDE), course[i])) == together[i]
