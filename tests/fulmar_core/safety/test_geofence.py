"""The area that a robot must not leave."""

from __future__ import annotations

import math

import pytest

from fulmar_core.errors import ConfigError
from fulmar_core.safety.geofence import NO_AREA, check_area, check_places, outside, unreachable

LAB = (0.0, 5.0, -3.0, 0.0)


def test_inside_and_on_the_edge_is_not_outside():
    assert outside(2.5, -1.5, LAB) == ""
    assert outside(5.0, 0.0, LAB) == ""


@pytest.mark.parametrize("place", [(5.1, -1.0), (-0.1, -1.0), (2.0, 0.1), (2.0, -3.1), (math.nan, -1.0)])
def test_beyond_an_edge_is_outside_and_says_where(place):
    assert "outside its area" in outside(*place, LAB)


def test_no_area_has_no_outside():
    assert outside(1e9, -1e9, NO_AREA) == ""


@pytest.mark.parametrize("area", [(1.0, 0.0, 0.0, 1.0), (0.0, 1.0), (0.0, math.inf, 0.0, 1.0)])
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


@pytest.mark.parametrize("place", [(1000.1, 0.0), (-800.0, 800.0), (math.nan, 0.0)])
def test_a_place_farther_than_a_kilometre_is_unreachable_without_an_area(place):
    assert "farther than 1,000 m" in unreachable("the goal", [place], NO_AREA)
    assert unreachable("the goal", [(600.0, 800.0)], NO_AREA) == ""
