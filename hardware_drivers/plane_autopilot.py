"""What ArduPlane says of itself, and what it is asked for: failsafe parameters and attitudes."""

from __future__ import annotations

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hardware_drivers.flight_set_points import SetPoint
from hardware_drivers.mavlink_autopilot import Autopilot
from hardware_drivers.mavlink_link import HOST_SYSTEM, Address
from hardware_drivers.mavlink_parameters import Wanted
from hardware_drivers.plane_settings import ACTIONS, MavlinkPlane
from hardware_drivers.px4_messages import attitude_fields

GUIDED, LOITER = 15, 12  # of ArduPlane's modes
PLANE_MODES = {
    0: "MANUAL", 1: "CIRCLE", 2: "STABILIZE", 3: "TRAINING", 4: "ACRO", 5: "FBWA", 6: "FBWB", 7: "CRUISE",
    8: "AUTOTUNE", 10: "AUTO", 11: "RTL", LOITER: "LOITER", 13: "TAKEOFF", 14: "AVOID_ADSB", GUIDED: "GUIDED",
    16: "INITIALISING", 24: "THERMAL",
}  # fmt: skip
# ArduPlane reads the bits of the three turn rates as those of roll, pitch and yaw where the attitude's own bit is set,
# and takes a yaw for a deflection of the rudder: roll, pitch and thrust are given, and yaw is left out.
ROLL_AND_PITCH = 0b10111100


class PlaneAutopilot(Autopilot):
    """State of an ArduPlane; see `Autopilot`, whose channels it has no use for."""

    KINDS = (mavlink.MAV_TYPE_FIXED_WING,)
    WANTED = "ArduPlane"

    def __init__(self) -> None:
        """Begin with nothing known."""
        super().__init__(1, 3)

    def beaten_before_s(self, now_s: float) -> float:
        """Age of the newest heartbeat; infinite before the first [s]."""
        return float("inf") if self._beaten_s is None else now_s - self._beaten_s

    @property
    def mode_name(self) -> str:
        """Its mode as number and name; empty as long as it is not known."""
        if self.mode is None:
            return ""
        return f"{self.mode} ({PLANE_MODES[self.mode]})" if self.mode in PLANE_MODES else str(self.mode)


def protection(settings: MavlinkPlane) -> tuple[Wanted, ...]:
    """Parameters by which ArduPlane flies on by itself without our heartbeats, and without the pilot's transmitter."""
    action, host, loss_s = float(ACTIONS[settings.action]), float(HOST_SYSTEM), settings.loss_s
    wanted = (
        Wanted(("SYSID_MYGCS", "MAV_GCS_SYSID"), host, lambda value: value == host, "whose heartbeats count"),
        Wanted(("FS_LONG_ACTN",), action, lambda value: value == action, f"without heartbeats: {settings.action}"),
        Wanted(
            ("FS_LONG_TIMEOUT",), loss_s, lambda value: 0.0 < value <= loss_s + 1e-3, "seconds without heartbeats"
        ),
        Wanted(("FS_GCS_ENABL",), 1.0, lambda value: value in (1.0, 2.0), "the failsafe of heartbeats"),
    )  # fmt: skip
    if not settings.rc_failsafe:
        return wanted
    return (
        *wanted,
        Wanted(("THR_FAILSAFE",), 1.0, lambda value: value == 1.0, "the failsafe of the transmitter"),
    )


def attitude_target(point: SetPoint, boot_ms: int, autopilot: Address) -> Any:
    """SET_ATTITUDE_TARGET with the roll, pitch and thrust of a set point, at a time since the start [ms]."""
    quat = attitude_fields(point.quat_xyzw)
    return mavlink.MAVLink_set_attitude_target_message(
        boot_ms, *autopilot, ROLL_AND_PITCH, quat, 0.0, 0.0, 0.0, point.thrust
    )
