"""The area that a robot must not leave."""

from __future__ import annotations

import math

import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.geofence import (
    NO_AREA,
    check_area,
    check_area_of,
    check_places,
    farthest_goal,
    outside,
    unreachable,
)

LAB = (0.0, 5.0, -3.0, 0.0)


def test_inside_and_on_the_edge_is_not_outside():
    assert outside((2.5, -1.5), LAB) == ""
    assert outside((5.0, 0.0), LAB) == ""


@pytest.mark.parametrize("place", [(5.1, -1.0), (-0.1, -1.0), (2.0, 0.1), (2.0, -3.1), (math.nan, -1.0)])
def test_beyond_an_edge_is_outside_and_says_where(place):
    assert "outside its area" in outside(place, LAB)


def test_no_area_has_no_outside():
    assert outside((1e9, -1e9), NO_AREA) == ""


@pytest.mark.parametrize(
    "area",
    [
        (1.0, 0.0, 0.0, 1.0),
        (0.0, 1.0),
        (0.0, math.inf, 0.0, 1.0),
        (0.0, 1.0, 0.0, 1.0, 0.0),
        (0.0, 1.0, 0.0, 1.0, 2.0, 1.0),
    ],
)
def test_what_is_no_area_is_refused(area):
    with pytest.raises(ValueError, match="x_min"):
        check_area(area)


def test_the_first_of_some_places_that_is_outside_is_named_with_the_area():
    check_places("the goal", [(1.0, -1.0), (5.0, 0.0, 90.0)], LAB)
    with pytest.raises(ConfigError) as caught:
        check_places("the goal", [(1.0, -1.0), (1.0, 2.0, 90.0)], LAB)
    assert str(caught.value) == (
        "the goal x = 1 m, y = 2 m lies outside the area of x 0 to 5 m, y -3 to 0 m. Give another place, in metres."
    )


def test_goals_of_a_robot_lie_within_a_kilometre_or_within_its_geofence_where_that_is_wider():
    assert farthest_goal(load_robot("turtlebot2")) == 1000.0
    craft = load_robot("airship_v7")
    assert farthest_goal(craft) == craft.limits.geofence > 1000.0
    check_places("the goal", [(1002.4, 0.0, 2.9, 0.0, 0.0, 0.0, 1.0)], NO_AREA, farthest_goal(craft))
    with pytest.raises(ConfigError, match="farther than 10,000 m"):
        check_places("the goal", [(10_001.0, 0.0, 2.9, 0.0, 0.0, 0.0, 1.0)], NO_AREA, farthest_goal(craft))


@pytest.mark.parametrize("place", [(1000.1, 0.0), (-800.0, 800.0), (math.nan, 0.0)])
def test_a_place_farther_than_a_kilometre_is_unreachable_without_an_area(place):
    assert "farther than 1,000 m" in unreachable("the goal", [place], NO_AREA)
    assert unreachable("the goal", [(600.0, 800.0)], NO_AREA) == ""


BOX = (*LAB, -1.0, 1.0)


def test_a_box_has_a_floor_and_a_ceiling():
    check_area(BOX)
    assert outside((1.0, -1.0, 0.9), BOX) == ""
    found = outside((1.0, -1.0, 1.25), BOX)
    assert "z = 1.25 m, outside its area of x 0 to 5 m, y -3 to 0 m, z -1 to 1 m" in found
    check_places("the goal", [(1.0, -1.0, 0.5, 0.0, 0.0, 0.0, 1.0)], BOX)
    with pytest.raises(ConfigError, match="z = -2 m lies outside"):
        check_places("the goal", [(1.0, -1.0, -2.0, 0.0, 0.0, 0.0)], BOX)


def test_a_heading_is_no_height_and_a_height_counts_in_the_kilometre():
    check_places("the goal", [(1.0, -1.0, 5000.0)])  # degrees
    with pytest.raises(ConfigError, match="farther than 1,000 m"):
        check_places("the goal", [(0.0, 0.0, 1000.5, 0.0, 0.0, 0.0)])


@pytest.mark.parametrize(("robot", "area"), [("spacecraft_16", LAB), ("floating_platform", BOX)])
def test_an_area_of_the_other_space_is_refused(robot, area):
    with pytest.raises(ConfigError, match="sides: x_min,x_max,y_min,y_max"):
        check_area_of(load_robot(robot), area)
    check_area_of(load_robot(robot), NO_AREA)
