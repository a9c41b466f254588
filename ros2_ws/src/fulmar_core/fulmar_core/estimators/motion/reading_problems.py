"""What no sound sensor says, whatever the robot does: numbers that are none, turn rates beyond the possible."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fulmar_core.states.rotation import size_of
from fulmar_core.wires.reading import Reading

LONGEST_OFF = 0.01  # by which the norm of a quaternion may differ from 1, our value


def inertial_problem(reading: Reading, turn_rate: Callable[[Reading], float], most: float) -> str:
    """Why an inertial reading is not believed; empty if it is.

    Args:
        reading: Of a specific force, a turn rate, or both.
        turn_rate: What of it the robot's limits bound [rad/s].
        most: Limit of the turn rate [rad/s]; twice as much is impossible.
    """
    value = reading.value
    if not value.is_finite:
        return "inertial reading holds a value that is not finite"
    if not (value.has_force or value.has_rate):
        return "inertial reading has neither a specific force nor a turn rate"
    rate = turn_rate(reading) if value.has_rate else 0.0
    if abs(rate) > 2.0 * most:
        return f"turn rate {rate:.1f} rad/s is beyond the possible {most:g} rad/s"
    return ""


def pose_problem(what: str, reading: Reading) -> str:
    """Why a pose or an attitude, whose quaternion stands at its end, is not believed; empty if it is.

    Args:
        what: It is called so.
        reading: With an array, shape (7,) or (4,).
    """
    if not np.isfinite(reading.value).all():
        return f"{what} holds a value that is not finite"
    norm = size_of(reading.value[-4:])
    if abs(norm - 1.0) > LONGEST_OFF:
        return f"quaternion of the {what} has norm {norm:.3f}, must be 1"
    return ""


def saturation(reading: Reading, gyroscope_range: float) -> str:
    """Why the turn rate of an inertial reading is saturated; empty if it is not, or there is none.

    Args:
        reading: Of inertial sensors.
        gyroscope_range: Largest turn rate about an axis that they have [rad/s].
    """
    if not reading.value.is_finite or not reading.value.has_rate:
        return ""
    largest = max(map(abs, reading.value.angular_velocity.tolist()))
    if largest < gyroscope_range:
        return ""
    return f"the gyroscope reads {largest:.2f} rad/s, the end of its range: the body tumbles too fast for it"
