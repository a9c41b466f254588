"""Attitudes of boats as quaternions: from north-east-down and starboard to east-north-up and port."""

from __future__ import annotations

import math

import numpy as np

from fulmar_core.rotation import from_yaw, multiply


def attitude(roll: float, pitch: float, heading: float) -> np.ndarray:
    """The attitude that sailors describe.

    Args:
        roll: Starboard down [rad].
        pitch: Bow up [rad].
        heading: Clockwise from north [rad].

    Returns:
        Of the body (x ahead, y to port, z up) in the world (x east, y north, z up), xyzw, shape (4,).
    """
    yaw = from_yaw(np.asarray(0.5 * math.pi - heading))
    nose = np.array([0.0, math.sin(-0.5 * pitch), 0.0, math.cos(0.5 * pitch)])
    heel = np.array([math.sin(0.5 * roll), 0.0, 0.0, math.cos(0.5 * roll)])
    return np.asarray(multiply(multiply(yaw, nose), heel))
