"""Ways around discs."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.controllers.around import CREEP, Around
from fulmar_core.tasks.obstacles import FAR

AROUND = Around(clearance=0.3, turn_cost=0.0, speed=1.0)
RADIUS = 0.2
WIDE = 0.5


def aim(goal, *discs, course=0.0, side=0.0):
    """Direction [rad], length, room and side for discs at (x, y)."""
    x, y = (np.array([disc[axis] for disc in discs], dtype=float) for axis in (0, 1))
    goal = np.asarray(goal[0], dtype=float), np.asarray(goal[1], dtype=float)
    (ax, ay), room, side = AROUND.aim(goal, (x, y, RADIUS), np.asarray(course), np.asarray(side))
    return float(np.arctan2(ay, ax)), float(np.hypot(ax, ay)), float(room), float(side)


def test_a_free_way_is_taken_as_it_is():
    angle, length, room, side = aim((3.0, 1.0), (0.0, 2.0), (-FAR, 0.0))
    assert (angle, length) == pytest.approx((np.arctan2(1.0, 3.0), np.hypot(3.0, 1.0)))
    assert (room, side) == (np.inf, 0.0)


def test_what_stands_behind_the_goal_is_not_in_the_way():
    assert aim((1.0, 0.0), (2.0, 0.0))[0] == pytest.approx(0.0)


@pytest.mark.parametrize("beside", [0.1, -0.1])
def test_a_disc_in_the_way_is_passed_along_its_tangent_on_the_shorter_side(beside):
    angle, length, _, side = aim((4.0, 0.0), (2.0, beside))
    far = np.hypot(2.0, beside)
    tangent = np.arctan2(beside, 2.0) - np.sign(beside) * np.arcsin(WIDE / far)
    assert angle == pytest.approx(tangent)
    assert side == -np.sign(beside)
    assert 4.0 < length < 4.4
    # The line keeps exactly the wanted distance from the centre.
    assert abs(2.0 * np.sin(angle) - beside * np.cos(angle)) == pytest.approx(WIDE)


def test_no_line_leads_between_discs_that_leave_no_room():
    angle, *_ = aim((4.0, 0.0), (2.0, 0.45), (2.0, -0.35))
    assert angle == pytest.approx(np.arctan2(-0.35, 2.0) - np.arcsin(WIDE / np.hypot(2.0, 0.35)))
    through, *_ = aim((4.0, 0.0), (2.0, 0.55), (2.0, -0.55))
    assert through == pytest.approx(0.0)


def test_the_side_that_was_begun_is_kept_for_a_small_detour():
    assert aim((4.0, 0.0), (2.0, 0.1))[3] == -1.0
    assert aim((4.0, 0.0), (2.0, 0.1), side=1.0)[3] == 1.0


def test_who_is_too_near_is_led_away():
    angle, *_ = aim((4.0, 0.0), (0.3, 0.05))
    assert abs(angle) > np.pi / 2
    assert 0.3 * np.cos(angle) + 0.05 * np.sin(angle) < 0.0


def test_room_is_what_is_free_in_the_direction_of_travel():
    assert aim((4.0, 0.0), (2.0, 0.0))[2] == pytest.approx(2.0 - WIDE)
    assert aim((4.0, 0.0), (2.0, 0.0), course=np.pi)[2] == np.inf
    assert aim((4.0, 0.0), (0.3, 0.0))[2] == CREEP


def test_a_batch_is_answered_like_its_members():
    rng = np.random.default_rng(5)
    gx, gy, course = 3.0 * rng.normal(size=(3, 40))
    x, y = 2.0 * rng.normal(size=(2, 40, 3))
    side = rng.integers(-1, 2, 40).astype(float)
    together = AROUND.aim((gx, gy), (x, y, RADIUS), course, side)
    for i in range(40):
        alone = AROUND.aim((gx[i], gy[i]), (x[i], y[i], RADIUS), course[i], side[i])
        np.testing.assert_allclose(alone[0], [together[0][0][i], together[0][1][i]], atol=1e-12)
        assert (alone[1], alone[2]) == (together[1][i], together[2][i])


@pytest.mark.parametrize(("name", "value"), [("clearance", 0.0), ("speed", 0.0), ("turn_cost", -1.0)])
def test_numbers_without_meaning_are_refused(name, value):
    with pytest.raises(ValueError, match=f"'{name}'"):
        Around(**({"clearance": 0.3, "turn_cost": 0.1, "speed": 1.0} | {name: value}))
