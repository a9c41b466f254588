"""Distance between hulls: discs, rectangles, and one of each, against a search over points."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.robots.hull_distance import hull_distance
from fulmar_core.robots.robot_file import load_robot

DISC, BOX = load_robot("floating_platform"), load_robot("kingfisher")


def outline(robot, pose):
    """Points on the outline in the world, shape (n, 2) [m]."""
    if robot.body.footprint is None:
        angle = np.linspace(0.0, 2.0 * np.pi, 2000)
        return pose[:2] + robot.body.radius * np.stack((np.cos(angle), np.sin(angle)), axis=-1)
    length, width = robot.body.footprint
    side = np.linspace(-0.5, 0.5, 1000)
    edges = [(s * length, e * width) for s in side for e in (-0.5, 0.5)]
    edges += [(e * length, s * width) for s in side for e in (-0.5, 0.5)]
    points = np.array(edges) + np.array([robot.body.footprint_x, 0.0])
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    return pose[:2] + points @ np.array([[cos, sin], [-sin, cos]])


@pytest.mark.parametrize(("first", "second"), [(DISC, DISC), (DISC, BOX), (BOX, DISC), (BOX, BOX)])
def test_it_is_the_least_distance_between_two_outlines(first, second):
    draws = np.random.default_rng(0)
    for _ in range(5):
        one = np.array([0.0, 0.0, draws.uniform(-3, 3)])
        other = np.array([*draws.uniform(2.0, 3.0, 2), draws.uniform(-3, 3)])
        points, others = outline(first, one), outline(second, other)
        near = min(float(np.linalg.norm(others - point, axis=-1).min()) for point in points[::3])
        assert hull_distance(first, one[None], second, other[None])[0] == pytest.approx(near, abs=5e-3)


def test_hulls_that_overlap_have_no_distance():
    same, crossed = np.array([[0.0, 0.0, 0.3]]), np.array([[0.2, 0.1, 1.9]])
    assert hull_distance(BOX, same, BOX, crossed)[0] == 0.0
    assert hull_distance(DISC, same, DISC, crossed)[0] < 0.0
    assert hull_distance(DISC, same, BOX, crossed)[0] < 0.0
