"""Distance between the hulls of two robots in the plane: discs, and rectangles with a footprint."""

from __future__ import annotations

import numpy as np

from fulmar_core.robots.robot import Robot


def hull_distance(first: Robot, one: np.ndarray, second: Robot, other: np.ndarray) -> np.ndarray:
    """Distance between two hulls, 0 or less where they overlap.

    Args:
        first: A robot.
        one: Its poses, shape (n, 3): x, y [m], heading [rad].
        second: Another robot.
        other: Its poses at the same times, shape (n, 3).

    Returns:
        Shape (n,) [m]; of overlapping rectangles 0, of discs how deep they overlap, negative.
    """
    round_one, round_other = first.body.footprint is None, second.body.footprint is None
    if round_one and round_other:
        far = np.linalg.norm(one[:, :2] - other[:, :2], axis=-1)
        return np.asarray(far - first.body.radius - second.body.radius)
    if round_one:
        return _to_box(one[:, :2], second, other) - first.body.radius
    if round_other:
        return _to_box(other[:, :2], first, one) - second.body.radius
    corners, others = _corners(first, one), _corners(second, other)
    far = [_to_box(corners[:, i], second, other) for i in range(4)]
    far += [_to_box(others[:, i], first, one) for i in range(4)]
    return np.where(_cross(corners, others), 0.0, np.maximum(np.min(far, axis=0), 0.0))


def _to_box(place: np.ndarray, robot: Robot, pose: np.ndarray) -> np.ndarray:
    """Distance of points, shape (n, 2), from a rectangle; 0 inside [m]."""
    assert robot.body.footprint is not None
    half = 0.5 * np.array(robot.body.footprint)
    cos, sin = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    away = place - pose[:, :2]
    ahead = cos * away[:, 0] + sin * away[:, 1] - robot.body.footprint_x
    left = cos * away[:, 1] - sin * away[:, 0]
    beyond = np.maximum(np.abs(np.stack((ahead, left), axis=-1)) - half, 0.0)
    return np.asarray(np.linalg.norm(beyond, axis=-1))


def _corners(robot: Robot, pose: np.ndarray) -> np.ndarray:
    """Corners of a rectangle in the world, shape (n, 4, 2) [m]."""
    assert robot.body.footprint is not None
    length, width = robot.body.footprint
    own = np.array([(sx * length / 2, sy * width / 2) for sx, sy in ((1, 1), (-1, 1), (-1, -1), (1, -1))])
    own[:, 0] += robot.body.footprint_x
    cos, sin = np.cos(pose[:, 2:3]), np.sin(pose[:, 2:3])
    x, y = own[:, 0], own[:, 1]
    turned = np.stack((cos * x - sin * y, sin * x + cos * y), axis=-1)
    return np.asarray(turned + pose[:, None, :2])


def _cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Whether two rectangles overlap, by the separating axes of both, shape (n,)."""
    apart = np.zeros(len(one), dtype=bool)
    for box in (one, other):
        for side in (box[:, 1] - box[:, 0], box[:, 2] - box[:, 1]):
            spans = [np.sum(corners * side[:, None], axis=-1) for corners in (one, other)]
            apart |= spans[0].max(axis=1) < spans[1].min(axis=1)
            apart |= spans[1].max(axis=1) < spans[0].min(axis=1)
    return ~apart
