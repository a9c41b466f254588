"""Messages of PX4 in ROS' frames and back; knows fields, not the link.

PX4 counts time in µs, its world is north-east-down (or ahead-right-down of an own origin), its body ahead-right-down,
and its quaternions begin with w. Fields are those of px4_msgs, release 1.16.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.states.rotation import multiply, rotate
from fulmar_core.states.state import RigidBodyState

NED, FRD, BODY_FRD = 1, 2, 3  # of pose_frame and velocity_frame
HALF = math.sqrt(0.5)
# From north-east-down to east-north-up: half a turn about the axis between east and north. It is its own inverse, and
# so is the half turn about x from ahead-right-down to ahead-left-up.
WORLDS = {NED: np.array([HALF, HALF, 0.0, 0.0]), FRD: np.array([1.0, 0.0, 0.0, 0.0])}
ABOUT_X = np.array([1.0, 0.0, 0.0, 0.0])
UNIT = 0.02  # a quaternion may miss length 1 by so much
INVALID_US = 2147483647  # of a relative time stamp
FLIPPED = np.array([1.0, -1.0, -1.0])


def odometry_of(message: Any) -> tuple[RigidBodyState | None, str]:
    """State of a VehicleOdometry in the world's frame, and why there is none; one of both is empty."""
    if message.pose_frame not in WORLDS:
        return None, f"its pose is in frame {message.pose_frame}, neither NED (1) nor FRD (2)"
    place, velocity = _vector(message.position), _vector(message.velocity)
    q, rates = np.array([float(part) for part in message.q]), _vector(message.angular_velocity)
    if not all(np.isfinite(part).all() for part in (place, velocity, q, rates)):
        return None, "its pose, velocity or turn rate is not known yet (NaN)"
    length = float(np.linalg.norm(q))
    if abs(length - 1.0) > UNIT:
        return None, f"its quaternion has length {length:.3f}"
    world = WORLDS[message.pose_frame]
    w, x, y, z = q / length
    quat = np.asarray(multiply(multiply(world, np.array([x, y, z, w])), ABOUT_X))
    if message.velocity_frame == BODY_FRD:
        turned = rotate(quat, FLIPPED * velocity)
    elif message.velocity_frame in WORLDS:
        turned = rotate(WORLDS[message.velocity_frame], velocity)
    else:
        return None, f"its velocity is in frame {message.velocity_frame}, which is none of NED, FRD and body"
    return RigidBodyState(rotate(world, place), quat, np.asarray(turned), FLIPPED * rates), ""


def imu_of(message: Any) -> ImuSample | None:
    """Reading of a SensorCombined; None where the accelerometer's is invalid."""
    force, turn = _vector(message.accelerometer_m_s2), _vector(message.gyro_rad)
    invalid = message.accelerometer_timestamp_relative == INVALID_US
    if invalid or not (np.isfinite(force).all() and np.isfinite(turn).all()):
        return None
    return ImuSample(FLIPPED * force, FLIPPED * turn)


def attitude_fields(quat_xyzw: np.ndarray) -> list[float]:
    """Attitude of the body in east-north-up as `q_d`: of ahead-right-down in north-east-down, w first, w >= 0."""
    x, y, z, w = np.asarray(multiply(multiply(WORLDS[NED], quat_xyzw), ABOUT_X)).tolist()
    sign = -1.0 if w < 0.0 else 1.0
    return [sign * part for part in (w, x, y, z)]


def rate_fields(rates: np.ndarray) -> dict[str, float]:
    """Turn rates about ahead, left and up (3,) as fields of VehicleRatesSetpoint [rad/s]."""
    roll, pitch, yaw = (FLIPPED * rates).tolist()
    return {"roll": roll, "pitch": pitch, "yaw": yaw}


def _vector(values: Any) -> np.ndarray:
    return np.array([float(value) for value in values])
