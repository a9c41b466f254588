"""An ArduPilot boat at the end of a UDP link, the vehicle's side of MAVLink."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from pymavlink import mavutil

from fulmar_core.simulation.backend import Sample
from fulmar_core.states.rotation import rotate_inverse
from sim_nodes.emulators.mavlink2 import Intervals, link_to

OVERRIDE_S = 3.0  # RC_OVERRIDE_TIME: an override is forgotten after so long
GROUND_S = 1.5  # FS_TIMEOUT with FS_GCS_ENABLE: without the host's heartbeat for so long it holds
HEARTBEAT_S = 1.0
STEERING, THROTTLE = "chan1_raw", "chan3_raw"
TRIM, SPAN = 1500, 400  # [µs]
MANUAL = 0
G = 9.80665


class ArdupilotEmulator:
    """Arms, takes RC overrides in MANUAL, mixes them for skid steering, and reports what it is asked for.

    Attributes:
        mute: Report nothing, as a boat whose radio is off.
        denied: Numbers of commands that it refuses, and what it says then.
        deaf: Take no override, as from a host whose system id is not that of SYSID_MYGCS.
        mode: Of ArduPilot's boats; an operator may change it.
        armed: Whether the propellers may turn; an operator may change it.
    """

    def __init__(self, port: int, key: bytes = b"") -> None:
        """Switch it on; it speaks first, to a UDP port of this host, signed where it has a key."""
        self._link, self.address = link_to(port)
        if key:
            self._link.setup_signing(key, sign_outgoing=True)
        self.armed, self._mode = False, MANUAL
        self.denied: dict[int, str] = {}
        self.deaf = False
        self._shares = np.zeros(2)
        self._override_s = self._ground_s = self._beaten_s = -math.inf
        self._began_s: float | None = None
        self._intervals = Intervals()
        self.mute = False

    @property
    def mode(self) -> int:
        """Number of the mode."""
        return self._mode

    @mode.setter
    def mode(self, number: int) -> None:
        self._mode, self._beaten_s = number, -math.inf  # a heartbeat says so at once

    def command(self, now_s: float) -> np.ndarray:
        """See `EmulatedDevice`."""
        while (message := self._link.recv_match(blocking=False)) is not None:
            self._take(message, now_s)
        fresh = now_s - self._override_s <= OVERRIDE_S and now_s - self._ground_s <= GROUND_S
        return self._shares if fresh and self.armed and self._mode == MANUAL else np.zeros(2)

    def report(self, sample: Sample, now_s: float) -> None:
        """See `EmulatedDevice`."""
        if self._began_s is None:
            self._began_s = now_s
        if self.mute:
            return
        mav, mavlink = self._link.mav, mavutil.mavlink
        if now_s - self._beaten_s >= self._intervals.period_s(mavlink.MAVLINK_MSG_ID_HEARTBEAT, HEARTBEAT_S):
            self._beaten_s = now_s
            armed = mavlink.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0
            mode = armed | mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
            mav.heartbeat_send(
                mavlink.MAV_TYPE_SURFACE_BOAT, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mode, self._mode, 4
            )
            mav.sys_status_send(0, 0, 0, 100, 15800, -1, 80, 0, 0, 0, 0, 0, 0)
        self._send_what_is_due(sample, now_s, round(1e3 * (now_s - self._began_s)))

    def close(self) -> None:
        """See `EmulatedDevice`."""
        self._link.close()

    def _send_what_is_due(self, sample: Sample, now_s: float, boot_ms: int) -> None:
        state, mav, mavlink = sample.odometry, self._link.mav, mavutil.mavlink
        assert state is not None
        if self._intervals.is_due(mavlink.MAVLINK_MSG_ID_ATTITUDE, now_s):
            up = rotate_inverse(state.quat_xyzw, np.array([0.0, 0.0, 1.0]))
            roll, pitch = math.atan2(up[1], up[2]), math.asin(max(-1.0, min(1.0, float(up[0]))))
            yaw = (0.5 * math.pi - float(state.yaw) + math.pi) % (2.0 * math.pi) - math.pi
            p, q, r = state.angular_velocity_in_body.tolist()
            mav.attitude_send(boot_ms, roll, pitch, yaw, p, -q, -r)
        if self._intervals.is_due(mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED, now_s):
            (x, y, z), (vx, vy, vz) = state.position_in_world.tolist(), state.velocity_in_world.tolist()
            mav.local_position_ned_send(boot_ms, y, x, -z, vy, vx, -vz)
        if self._intervals.is_due(mavlink.MAVLINK_MSG_ID_RC_CHANNELS, now_s):
            left, right = self._shares if now_s - self._override_s <= OVERRIDE_S else (0.0, 0.0)
            steering, throttle = (
                round(TRIM + SPAN * value) for value in (0.5 * (left - right), 0.5 * (left + right))
            )
            others = [0] * 13
            mav.rc_channels_send(boot_ms, 16, steering, TRIM, throttle, TRIM, TRIM, *others, 255)
        if self._intervals.is_due(mavlink.MAVLINK_MSG_ID_RAW_IMU, now_s) and sample.imu is not None:
            force = np.round(1e3 / G * sample.imu.specific_force * (1.0, -1.0, -1.0)).astype(int).tolist()
            turn = np.round(1e3 * sample.imu.angular_velocity * (1.0, -1.0, -1.0)).astype(int).tolist()
            mav.raw_imu_send(1000 * boot_ms, *force, *turn, 0, 0, 0)

    def _take(self, message: Any, now_s: float) -> None:
        kind = message.get_type()
        if kind == "HEARTBEAT":
            self._ground_s = now_s
        elif kind == "RC_CHANNELS_OVERRIDE" and not self.deaf:
            steering, throttle = ((getattr(message, name) - TRIM) / SPAN for name in (STEERING, THROTTLE))
            self._shares = np.clip((throttle + steering, throttle - steering), -1.0, 1.0)
            self._override_s = now_s
        elif kind == "COMMAND_LONG":
            self._obey(message, now_s)

    def _obey(self, message: Any, now_s: float) -> None:
        mavlink = mavutil.mavlink
        result = mavlink.MAV_RESULT_ACCEPTED
        if message.command in self.denied:
            result = mavlink.MAV_RESULT_DENIED
            self._link.mav.statustext_send(
                mavlink.MAV_SEVERITY_CRITICAL, self.denied[message.command].encode()
            )
        elif message.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            self.armed = message.param1 == 1.0
        elif message.command == mavlink.MAV_CMD_DO_SET_MODE:
            self._mode = int(message.param2)
        elif message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            self._intervals.ask(int(message.param1), 1e-6 * message.param2, now_s)
        else:
            result = mavlink.MAV_RESULT_UNSUPPORTED
        self._link.mav.command_ack_send(message.command, result)
