"""Poses go from a robot's `odom` to `map` and back."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fulmar_console.live.places import AT_ORIGIN, angle_between, moved, moved_all, placed, unplaced

HALF = math.sqrt(0.5)
TURNED = (10.0, 20.0, 0.0, 0.0, 0.0, HALF, HALF)  # a quarter turn to the left


def test_a_robot_whose_odom_is_turned_moves_along_another_axis_of_the_map() -> None:
    pose = moved(TURNED, (1.0, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0))
    assert pose == pytest.approx((10.0, 21.0, 0.5, 0.0, 0.0, HALF, HALF))


def test_many_poses_move_as_one_does() -> None:
    poses = np.array([[1.0, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0], [2.0, -1.0, 0.0, HALF, 0.0, 0.0, HALF]])
    assert moved_all(TURNED, poses) == pytest.approx(np.array([moved(TURNED, pose) for pose in poses]))
    assert moved_all(AT_ORIGIN, poses) is poses


def test_a_goal_of_the_map_reaches_the_robot_in_its_own_odom() -> None:
    goal = (9.0, 23.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    assert placed(TURNED, unplaced(TURNED, goal)) == pytest.approx(goal)
    assert unplaced(TURNED, goal)[:3] == pytest.approx((3.0, 1.0, 1.0))


def test_a_velocity_is_the_bodys_own_and_stays() -> None:
    twist = (0.3, 0.0, 0.0, 0.0, 0.0, 0.1)
    assert placed(TURNED, twist) == unplaced(TURNED, twist) == twist


def test_the_angle_between_two_attitudes_does_not_mind_the_sign_of_a_quaternion() -> None:
    assert angle_between(AT_ORIGIN, TURNED) == pytest.approx(90.0)
    assert angle_between(TURNED, (0, 0, 0, *(-each for each in TURNED[3:]))) == pytest.approx(0.0, abs=1e-5)
