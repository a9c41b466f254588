"""Local frame and attitude of boats and aircraft: from WGS 84 and north-east-down to ROS' east-north-up, and back."""

from __future__ import annotations

import math

import numpy as np

from fulmar_core.states.attitude import euler_of
from fulmar_core.states.rotation import from_yaw, multiply

# WGS 84.
EQUATOR_M = 6378137.0
FLATTENING = 1.0 / 298.257223563


class LocalFrame:
    """The plane that touches the ellipsoid at an origin; within some kilometres it is as good as the ellipsoid."""

    def __init__(self, latitude: float, longitude: float) -> None:
        """Put the origin [deg, deg]; not at a pole."""
        self._latitude, self._longitude = latitude, longitude
        square = FLATTENING * (2.0 - FLATTENING)
        sine = math.sin(math.radians(latitude))
        bend = 1.0 - square * sine * sine
        self._north = math.radians(1.0) * EQUATOR_M * (1.0 - square) / bend**1.5  # metres a degree
        self._east = math.radians(1.0) * EQUATOR_M / math.sqrt(bend) * math.cos(math.radians(latitude))

    def metres(self, latitude: float, longitude: float) -> tuple[float, float]:
        """East and north of the origin [m, m], the short way round [deg, deg]."""
        east = (longitude - self._longitude + 180.0) % 360.0 - 180.0
        return east * self._east, (latitude - self._latitude) * self._north

    def degrees(self, east: float, north: float) -> tuple[float, float]:
        """Latitude and longitude of a place east and north of the origin [m, m], longitude from -180 to 180 [deg]."""
        longitude = self._longitude + east / self._east
        return self._latitude + north / self._north, (longitude + 180.0) % 360.0 - 180.0


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


def sailed_angles(quat_xyzw: np.ndarray) -> tuple[float, float, float]:
    """Roll, pitch and heading that `attitude` makes an attitude of, shape (4,); heading from 0 to 2 pi [rad]."""
    x, y, z, w = (np.asarray(part, dtype=float) for part in quat_xyzw)
    roll, pitch, yaw = (float(angle) for angle in euler_of((x, y, z, w)))
    return roll, -pitch, (0.5 * math.pi - yaw) % (2.0 * math.pi)
