"""Shortest ways around discs."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.tasks.shortest_paths import BLOCKED, CORNERS, shortest_way, survey

CLEARANCE, RADIUS = 0.3, 0.2
WIDE = CLEARANCE + RADIUS


def surveyed(goal, *discs):
    """Discs at (x, y), with the ways to a goal; one episode."""
    rows = np.array([(*disc, RADIUS) if len(disc) == 2 else disc for disc in discs], dtype=float)
    return survey(rows.reshape(1, -1, 3), np.array([goal], dtype=float), CLEARANCE)


def way(goal, *discs, start=(0.0, 0.0), known=None):
    """Angle [rad] and length of the way from a start."""
    known = surveyed(goal, *discs) if known is None else known
    to_goal = tuple(np.array([g - s], dtype=float) for g, s in zip(goal, start, strict=True))
    ux, uy, length = shortest_way(known[..., 0] - start[0], known[..., 1] - start[1], known, to_goal)
    return float(np.arctan2(uy[0], ux[0])), float(length[0])


def followed(goal, *discs, start=(0.0, 0.0), step=0.02, steps=1500):
    """Places of who always goes along the way, and the lengths that it promised."""
    known, at, places, lengths = surveyed(goal, *discs), np.array(start, dtype=float), [], []
    for _ in range(steps):
        angle, length = way(goal, start=at, known=known)
        places.append(at.copy())
        lengths.append(length)
        if length < 0.05:
            break
        at += step * np.array([np.cos(angle), np.sin(angle)])
    return np.array(places), np.array(lengths)


def test_a_free_way_is_straight():
    assert way((3.0, 1.0), (0.0, 2.0), (2.0, 3.0)) == pytest.approx((np.arctan2(1, 3), np.hypot(3, 1)))
    assert way((3.0, 1.0)) == pytest.approx((np.arctan2(1, 3), np.hypot(3, 1)))


def test_what_stands_behind_the_goal_or_is_not_there_is_not_in_the_way():
    assert way((1.0, 0.0), (2.0, 0.0)) == pytest.approx((0.0, 1.0))
    assert way((4.0, 0.0), (2.0, 0.0, 0.0)) == pytest.approx((0.0, 4.0), abs=1e-5)


@pytest.mark.parametrize("beside", [0.1, -0.1])
def test_a_disc_in_the_way_is_passed_along_its_tangent_on_the_shorter_side(beside):
    angle, length = way((4.0, 0.0), (2.0, beside))
    assert angle == pytest.approx(
        np.arctan2(beside, 2.0) - np.sign(beside) * np.arcsin(WIDE / np.hypot(2, beside))
    )
    half = np.hypot(2.0, beside)
    bend = 2.0 * np.arcsin(WIDE / half) - 2.0 * np.arctan2(abs(beside), 2.0)
    exact = 2.0 * np.sqrt(half**2 - WIDE**2) + WIDE * bend  # two tangents and the arc between them
    assert exact < length < exact + 0.15  # polygons are wider than discs


def test_no_way_leads_between_discs_that_leave_no_room():
    closed, _ = way((4.0, 0.0), (2.0, 0.48), (2.0, -0.46))
    assert closed == pytest.approx(np.arctan2(-0.46, 2.0) - np.arcsin(WIDE / np.hypot(2.0, 0.46)))
    assert way((4.0, 0.0), (2.0, 0.55), (2.0, -0.55)) == pytest.approx((0.0, 4.0))


def test_who_is_too_near_is_led_away():
    angle, _ = way((4.0, 0.0), (0.3, 0.05))
    assert 0.3 * np.cos(angle) + 0.05 * np.sin(angle) < 0.0


POCKET = [(2.6 * np.cos(a), 2.6 * np.sin(a)) for a in np.linspace(-1.4, 1.4, 10)]


def test_a_pocket_is_left_backwards_although_only_its_far_side_shows():
    places, lengths = followed((5.0, 0.0), *POCKET, start=(1.5, 0.1))
    assert lengths[0] > 6.0
    assert lengths[-1] < 0.05
    gaps = np.linalg.norm(places[:, None] - np.array(POCKET), axis=-1)
    assert gaps.min() > 0.95 * WIDE


def test_the_way_becomes_shorter_by_nearly_what_is_gone():
    rng = np.random.default_rng(3)
    for _ in range(20):
        discs = [tuple(d) for d in rng.uniform(-2.0, 2.0, (6, 2)) if abs(np.hypot(*d)) > 0.1]
        start, goal = np.array([-3.5, 0.0]), (3.5, 0.0)
        if min(np.hypot(d[0] - end[0], d[1] - end[1]) for d in discs for end in (start, goal)) < 1.2 * WIDE:
            continue
        _, lengths = followed(goal, *discs, start=start)
        assert lengths[-1] < 0.05
        assert len(lengths) * 0.02 < 1.05 * lengths[0] + 0.1  # as long as it promised
        assert np.diff(lengths).max() < 0.05  # it never turns back


def test_a_goal_that_is_walled_in_costs_one_crossing():
    ring = [(4.0 + np.cos(a), np.sin(a)) for a in np.arange(0.0, 2.0 * np.pi, 0.5)]
    _, length = way((4.0, 0.0), *ring)
    assert BLOCKED < length < 3.0 * BLOCKED


def test_a_batch_is_answered_like_its_members():
    rng = np.random.default_rng(5)
    discs = np.concatenate((2.0 * rng.normal(size=(20, 5, 2)), np.full((20, 5, 1), RADIUS)), axis=-1)
    goals = 3.0 * rng.normal(size=(20, 2))
    known = survey(discs, goals, CLEARANCE)
    assert known.shape == (20, 5, 4 + CORNERS)
    together = shortest_way(known[..., 0], known[..., 1], known, (goals[:, 0], goals[:, 1]))
    for i in range(20):
        alone = survey(discs[i : i + 1], goals[i : i + 1], CLEARANCE)
        np.testing.assert_array_equal(alone[0], known[i])
        one = shortest_way(known[i, :, 0], known[i, :, 1], known[i], (goals[i, 0], goals[i, 1]))
        np.testing.assert_allclose([float(part) for part in one], [part[i] for part in together], atol=1e-12)
