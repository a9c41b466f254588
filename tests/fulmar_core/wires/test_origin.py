"""Where the odometry of a robot begins in the frame that all robots share."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fulmar_core.wires.origin import HERE, check_origin, in_odom, origin_pose

HALF = math.sqrt(0.5)


@pytest.mark.parametrize(
    ("numbers", "pose"),
    [
        ((), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)),
        (HERE, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)),
        ((1.0, -2.0, 90.0), (1.0, -2.0, 0.0, 0.0, 0.0, HALF, HALF)),
        ((1.0, -2.0, 3.0, 90.0), (1.0, -2.0, 3.0, 0.0, 0.0, HALF, HALF)),
        ((1.0, -2.0, 3.0, 90.0, 0.0, 0.0), (1.0, -2.0, 3.0, HALF, 0.0, 0.0, HALF)),
    ],
)
def test_an_origin_is_a_place_with_a_heading_a_height_or_an_attitude(numbers, pose):
    assert origin_pose(numbers) == pytest.approx(pose)


@pytest.mark.parametrize(
    ("numbers", "words"),
    [
        ((1.0, 2.0), "three, four or six"),
        ((1.0, 2.0, 3.0, 4.0, 5.0), "three, four or six"),
        ((math.nan, 0.0, 0.0), "finite"),
        ((2e6, 0.0, 0.0), "at most 1,000,000 m"),
        ((0.0, 0.0, -2e6, 0.0), "at most 1,000,000 m"),
    ],
)
def test_what_is_no_origin_is_refused(numbers, words):
    with pytest.raises(ValueError, match=words):
        check_origin(numbers)


def test_a_pose_of_map_is_where_odom_sees_it() -> None:
    origin = np.array(origin_pose((10.0, 5.0, 90.0)))
    ahead = np.array([10.0, 7.0, 0.0, 0.0, 0.0, math.sin(math.pi / 4.0), math.cos(math.pi / 4.0)])
    np.testing.assert_allclose(in_odom(ahead, origin), [2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], atol=1e-12)
    many = in_odom(np.stack((ahead, ahead)), origin)
    assert many.shape == (2, 7)
