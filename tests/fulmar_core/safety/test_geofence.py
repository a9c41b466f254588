"""The area that a robot must not leave."""

from __future__ import annotations

import math

import pytest

from fulmar_core.safety.geofence import NO_AREA, check_area, outside

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
