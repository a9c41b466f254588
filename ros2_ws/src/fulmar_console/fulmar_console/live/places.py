"""Poses from a robot's own `odom` to `map`, and back. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fulmar_core.states.attitude import conjugate, product
from fulmar_core.states.rotation import multiply, rotate, turned

AT_ORIGIN = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def moved(origin: Sequence[float], pose: Sequence[float]) -> tuple[float, ...]:
    """A pose of `odom` in `map`; both as x, y, z and the quaternion x, y, z, w."""
    if tuple(origin) == AT_ORIGIN:
        return tuple(pose)
    x, y, z = turned(origin[3:], pose[:3])
    place = (x + origin[0], y + origin[1], z + origin[2])
    return (*place, *product(_quat(origin), _quat(pose)))


def moved_all(origin: Sequence[float], poses: np.ndarray) -> np.ndarray:
    """The same of many poses, shape (n, 7)."""
    if tuple(origin) == AT_ORIGIN:
        return poses
    turn = np.array(origin[3:])
    place = rotate(turn, poses[:, :3]) + np.array(origin[:3])
    return np.concatenate((place, multiply(turn, poses[:, 3:])), axis=1)


def placed(origin: Sequence[float], target: Sequence[float]) -> tuple[float, ...]:
    """A target of a goal in `map`; a velocity is in the body's frame, and stays."""
    return moved(origin, target) if len(target) == len(AT_ORIGIN) else tuple(target)


def unplaced(origin: Sequence[float], target: Sequence[float]) -> tuple[float, ...]:
    """The inverse of `placed`."""
    if len(target) != len(AT_ORIGIN) or tuple(origin) == AT_ORIGIN:
        return tuple(target)
    back = conjugate(_quat(origin))
    place = turned(back, [a - b for a, b in zip(target[:3], origin[:3], strict=True)])
    return (*place, *product(back, _quat(target)))


def angle_between(one: Sequence[float], other: Sequence[float]) -> float:
    """Between two attitudes, as the quaternions of two poses [deg]."""
    cosine = abs(sum(a * b for a, b in zip(one[3:], other[3:], strict=True)))
    return math.degrees(2.0 * math.acos(min(1.0, cosine)))


def _quat(pose: Sequence[float]) -> tuple[float, float, float, float]:
    """The attitude of a pose."""
    x, y, z, w = pose[3:]
    return x, y, z, w
