"""Telemetry of an ArduPilot boat in ROS' frames; knows messages, not the link."""

from __future__ import annotations

from typing import Any

import numpy as np

from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.states.state import RigidBodyState
from hardware_drivers.earth_frame import attitude
from hardware_drivers.feedback import DeviceTime, Report

MILLI_G = 9.80665e-3  # [m/s²]
FRESH_MS = 200.0  # an attitude and a position further apart in time make no report
UNKNOWN_MV = 65535  # of a battery that is not measured; ArduPilot without a battery monitor sends 0


class Telemetry:
    """Assembles reports from an autopilot's messages.

    Attributes:
        voltage: Of the battery, as text [V]; empty as long as it is not known.
    """

    def __init__(self) -> None:
        self.voltage = ""
        self._time = DeviceTime()
        self._attitude: Any = None
        self._imu: ImuSample | None = None

    def take(self, message: Any, now_ns: int) -> Report | None:
        """Take a message of the autopilot.

        Args:
            message: As pymavlink decodes it.
            now_ns: When it came, since the epoch [ns].

        Returns:
            A report in the autopilot's own frame, with a position that belongs to a known attitude; most messages give
            none.
        """
        kind = message.get_type()
        if kind == "ATTITUDE":
            self._attitude = message
        elif kind == "RAW_IMU":
            ahead, right, down = message.xacc, message.yacc, message.zacc
            turn = 1e-3 * np.array([message.xgyro, -message.ygyro, -message.zgyro])
            self._imu = ImuSample(MILLI_G * np.array([ahead, -right, -down]), turn)
        elif kind == "SYS_STATUS":
            millivolts = message.voltage_battery
            self.voltage = "" if millivolts in (0, UNKNOWN_MV) else f"{1e-3 * millivolts:.1f}"
        elif kind == "LOCAL_POSITION_NED" and self._attitude is not None:
            state = state_of(message, self._attitude)
            if state is not None:
                return Report(state, self._imu, self._time.stamp_ns(float(message.time_boot_ms), now_ns))
        return None


def state_of(position: Any, attitude_of: Any) -> RigidBodyState | None:
    """State in ROS' frames: from north-east-down and starboard to east-north-up and port.

    Args:
        position: LOCAL_POSITION_NED.
        attitude_of: ATTITUDE.

    Returns:
        The state; None where the two are of different times, or not finite.
    """
    if abs(position.time_boot_ms - attitude_of.time_boot_ms) > FRESH_MS:
        return None
    values = np.array(
        [
            position.x, position.y, position.z, position.vx, position.vy, position.vz,
            attitude_of.roll, attitude_of.pitch, attitude_of.yaw,
            attitude_of.rollspeed, attitude_of.pitchspeed, attitude_of.yawspeed,
        ]
    )  # fmt: skip
    if not np.isfinite(values).all():
        return None
    north, east, down, vn, ve, vd, roll, pitch, yaw, p, q, r = values.tolist()
    return RigidBodyState(
        np.array([east, north, -down]),
        attitude(roll, pitch, yaw),
        np.array([ve, vn, -vd]),
        np.array([p, -q, -r]),
    )
