"""Rank and limits of wrenches: those of published layouts, and of small ones that can be worked out by hand."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from fulmar_core.robots.actuators.response import Response
from fulmar_core.robots.robot_file import load_robot
from fulmar_evaluation.wrench_limits import AXES, WrenchSet, wrench_set_of
from tests.new_robots import new_robot, robots_of_every_family

SPACECRAFT, BALL = load_robot("spacecraft_16"), load_robot("int_ball2")
ROBOTS = robots_of_every_family()


def both_ways(wrenches):
    """Limits of a layout that can do the same either way."""
    np.testing.assert_allclose(wrenches.limits[:, 0], -wrenches.limits[:, 1], rtol=1e-9)
    return wrenches.limits[:, 1]


def test_the_spacecraft_has_rank_6_and_one_newton_on_its_pressure_line():
    wrenches = wrench_set_of(SPACECRAFT)
    assert (wrenches.rank, wrenches.missing_axes, wrenches.axes) == (6, (), AXES)
    assert wrenches.holds_zero_with_all_on
    half = np.sqrt(0.5)  # N along x and y: its nozzles point along the diagonals
    expected = [half, half, 1.0, 0.31 * half, 0.31 * half, 0.31]
    np.testing.assert_allclose(both_ways(wrenches), expected, rtol=1e-6)


def test_the_spacecraft_without_a_shared_line_has_the_limits_of_rans():
    """Facts of RANS 3-D, `split_thrust` off: four nozzles of 1 N for each way."""
    expected = [2.828, 2.828, 4.0, 0.877, 0.877, 1.24]
    np.testing.assert_allclose(
        both_ways(wrench_set_of(SPACECRAFT).without_shared_line()), expected, rtol=1e-3
    )


def test_int_ball2_has_the_limits_of_its_published_layout():
    wrenches = wrench_set_of(BALL)
    assert (wrenches.rank, wrenches.missing_axes) == (6, ())
    assert wrenches.holds_zero_with_all_on
    expected = [0.1810, 0.0996, 0.1222, 3.03e-3, 4.55e-3, 8.19e-3]
    np.testing.assert_allclose(both_ways(wrenches), expected, rtol=1e-3)


def test_about_another_point_pure_torques_stay_and_pure_forces_shrink():
    wrenches = wrench_set_of(BALL)
    moved = wrenches.about(BALL.body.com)
    np.testing.assert_allclose(moved.limits[3:], wrenches.limits[3:], rtol=1e-6)
    assert (moved.limits[:3, 1] < 0.99 * wrenches.limits[:3, 1]).all()
    assert moved.rank == 6
    assert moved.holds_zero_with_all_on


def test_the_placeholder_of_roboran_has_no_torque_about_y():
    wrenches = wrench_set_of(new_robot("placeholder_ball"))
    assert (wrenches.rank, wrenches.missing_axes) == (5, ("torque_y",))
    assert wrenches.limits[4].tolist() == [0.0, 0.0]
    assert wrenches.holds_zero_with_all_on  # that alone would not show it


def flat(columns, *, least=0.0, shared=False):
    """A set in the plane, from one wrench for each actuator."""
    columns = np.array(columns, dtype=float).T
    return WrenchSet(("force_x", "force_y", "torque_z"), columns, np.full(columns.shape[1], least), shared)


def test_one_way_actuators_that_all_push_ahead_do_not_hold_zero():
    wrenches = flat([(1, 0, 0.1), (1, 0, -0.1), (1, 1, 0), (1, -1, 0)])
    assert wrenches.rank == 3
    assert not wrenches.holds_zero_with_all_on
    np.testing.assert_allclose(wrenches.limits[0], [0.0, 4.0])  # all of them on; nothing pushes back


def test_one_actuator_without_any_against_it_does_not_hold_zero_with_all_on():
    four = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)]
    assert flat(four).holds_zero_with_all_on
    assert not flat([*four, (0, 0, 0.2)]).holds_zero_with_all_on


def test_axes_that_only_come_together_are_both_missing():
    wrenches = flat([(1, 0, 0), (0, 1, 0.5)], least=-1.0)
    assert wrenches.rank == 2
    assert wrenches.missing_axes == ("force_y", "torque_z")
    assert wrenches.limits[1:].tolist() == [[0.0, 0.0], [0.0, 0.0]]


def test_a_propeller_is_weaker_astern():
    """Kingfisher: two of 19.5 N ahead and 4 N astern; a pure torque needs one ahead and one astern alike."""
    boat = load_robot("kingfisher")
    wrenches = wrench_set_of(boat)
    low, high = boat.actuators.curve[0], boat.actuators.curve[-1]
    np.testing.assert_allclose(wrenches.limits[0], [2.0 * low, 2.0 * high], rtol=1e-9)
    arm = abs(boat.actuators.lever_arms[0])
    np.testing.assert_allclose(wrenches.limits[2], [2.0 * low * arm, -2.0 * low * arm], rtol=1e-9)
    assert wrenches.missing_axes == ("force_y",)


def test_wheels_push_ahead_and_against_one_another():
    base = load_robot("turtlebot2")
    wrenches = wrench_set_of(base)
    expected = [base.performance.force, 0.0, base.performance.torque]
    np.testing.assert_allclose(both_ways(wrenches), expected, rtol=0.01)


@pytest.mark.parametrize("pure", [True, False])
def test_the_outline_of_four_nozzles_is_a_square_or_with_one_line_a_diamond(pure):
    four = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)]
    square = flat(four).outline(0, 1, pure=pure)
    assert sorted(np.round(square, 9).tolist()) == [[-1, -1], [-1, 1], [1, -1], [1, 1]]
    diamond = flat(four, shared=True).outline(0, 1, pure=pure)
    assert sorted(np.round(diamond, 9).tolist()) == [[-1, 0], [0, -1], [0, 1], [1, 0]]


@pytest.mark.parametrize("name", ["spacecraft_16", "int_ball2", "floating_platform", "fan_disc"])
def test_limits_are_where_the_axes_leave_the_convex_hull_of_all_corners(name):
    """Qhull from the corners of all commands, instead of a linear programme."""
    wrenches = wrench_set_of(ROBOTS[name])
    count = len(wrenches.least)
    corners = np.eye(count) if wrenches.shared else np.array(list(itertools.product((0, 1), repeat=count)))
    points = np.vstack((np.zeros(count), corners)) @ (wrenches.columns / wrenches.scale[:, None]).T
    facets = ConvexHull(points).equations  # n · w + c ≤ 0 inside
    for i, limits in enumerate(wrenches.limits / wrenches.scale[:, None]):
        ahead = facets[facets[:, i] > 1e-9]
        behind = facets[facets[:, i] < -1e-9]
        assert limits[1] == pytest.approx((-ahead[:, -1] / ahead[:, i]).min(), rel=1e-6)
        assert limits[0] == pytest.approx((-behind[:, -1] / behind[:, i]).max(), rel=1e-6)


def test_a_weak_response_changes_no_limit():
    """Gains of a calibration belong to worlds, as delays do: limits are of the layout."""
    weak = replace(SPACECRAFT, actuators=replace(SPACECRAFT.actuators, response=Response(gain=(0.5,) * 16)))
    np.testing.assert_array_equal(wrench_set_of(weak).limits, wrench_set_of(SPACECRAFT).limits)
