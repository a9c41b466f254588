"""An ArduPlane in flight at the end of a UDP link, the vehicle's side of MAVLink."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from pymavlink import mavutil
from scipy.spatial.transform import Rotation

from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.backend import Sample
from fulmar_core.states.rotation import rotate_inverse
from fulmar_core.states.state import RigidBodyState
from sim_nodes.emulators.inner_loop import InnerLoop
from sim_nodes.emulators.mavlink2 import Intervals, link_to
from sim_nodes.emulators.parameters import EmulatedParameters

MANUAL, RTL, LOITER, GUIDED = 0, 11, 12, 15
TARGET_S = 3.0  # an attitude is forgotten after so long, and GUIDED flies to its place
HEARTBEAT_S = 1.0
GROUND_SYSTEM = "SYSID_MYGCS"
G = 9.80665
DEFAULTS: dict[str, int | float] = {
    GROUND_SYSTEM: 255, "FS_GCS_ENABL": 0, "FS_LONG_ACTN": 0, "FS_LONG_TIMEOUT": 5.0, "THR_FAILSAFE": 1,
}  # fmt: skip
IGNORE_THRUST, IGNORE_ATTITUDE = 0b01000000, 0b10000000


class ArduPlaneEmulator:
    """Flies level in LOITER and RTL, and in GUIDED by the attitude that it is given.

    Attributes:
        mute: Send nothing, as one whose radio is off.
        frozen: Send positions of the same time again and again.
        denied: Numbers of commands that it refuses, and what it says then.
        mode: Of ArduPlane; an operator may change it.
        armed: Whether its motors may turn.
        kind: MAV_TYPE of its heartbeats.
        parameters: Of its failsafes.
    """

    def __init__(self, robot: Robot, port: int) -> None:
        """Switch it on; it speaks first, to a UDP port of this host."""
        self._link, self.address = link_to(port)
        self._inner = InnerLoop(robot)
        self.armed, self._mode, self.kind = True, LOITER, mavutil.mavlink.MAV_TYPE_FIXED_WING
        self.parameters = EmulatedParameters(DEFAULTS, bytewise=False)
        self.denied: dict[int, str] = {}
        self.mute = self.frozen = self.failsafe = False
        self.target: Any = None
        self.received: dict[str, int] = {}
        self._target_s = self._ground_s = self._beaten_s = -math.inf
        self._began_s: float | None = None
        self._frozen_ms: int | None = None
        self._intervals = Intervals()
        self._state: RigidBodyState | None = None

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
        self._see_loss(now_s)
        state, inner = self._state, self._inner
        if state is None:
            return inner.trim
        if self._mode != GUIDED or now_s - self._target_s > TARGET_S:
            return inner.level(state, now_s)
        w, x, y, z = self.target.q
        _, pitch, roll = Rotation.from_quat([x, y, z, w]).as_euler("ZYX")
        return inner.by_attitude(roll, pitch, self.target.thrust, state, now_s)

    def report(self, sample: Sample, now_s: float) -> None:
        """See `EmulatedDevice`."""
        self._state = sample.truth
        if self._began_s is None:
            self._began_s = now_s
        if self.mute:
            return
        mav, mavlink = self._link.mav, mavutil.mavlink
        if now_s - self._beaten_s >= self._intervals.period_s(mavlink.MAVLINK_MSG_ID_HEARTBEAT, HEARTBEAT_S):
            self._beaten_s = now_s
            armed = mavlink.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0
            mode = armed | mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
            status = 5 if self.failsafe else 4
            mav.heartbeat_send(self.kind, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mode, self._mode, status)
        boot_ms = round(1e3 * (now_s - self._began_s))
        if self.frozen:
            boot_ms = self._frozen_ms = self._frozen_ms or boot_ms
        self._send_what_is_due(sample, now_s, boot_ms)

    def close(self) -> None:
        """See `EmulatedDevice`."""
        self._link.close()

    def _send_what_is_due(self, sample: Sample, now_s: float, boot_ms: int) -> None:
        state, mav, mavlink = sample.odometry, self._link.mav, mavutil.mavlink
        assert state is not None
        ahead, left, up = rotate_inverse(state.quat_xyzw, np.asarray(state.velocity_in_world)).tolist()
        speed = math.sqrt(ahead**2 + left**2 + up**2)
        (x, y, z), (vx, vy, vz) = state.position_in_world.tolist(), state.velocity_in_world.tolist()
        if self._intervals.is_due(mavlink.MAVLINK_MSG_ID_ATTITUDE, now_s):
            yaw, pitch, roll = Rotation.from_quat(np.asarray(state.quat_xyzw)).as_euler("ZYX")
            heading = (0.5 * math.pi - yaw + math.pi) % (2.0 * math.pi) - math.pi
            p, q, r = state.angular_velocity_in_body.tolist()
            mav.attitude_send(boot_ms, roll, -pitch, heading, p, -q, -r)
        if self._intervals.is_due(mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED, now_s):
            mav.local_position_ned_send(boot_ms, y, x, -z, vy, vx, -vz)
        if self._intervals.is_due(mavlink.MAVLINK_MSG_ID_VFR_HUD, now_s):
            mav.vfr_hud_send(speed, math.hypot(vx, vy), 0, 0, z, vz)
        if self._intervals.is_due(mavlink.MAVLINK_MSG_ID_AOA_SSA, now_s):
            slip = math.asin(-left / speed) if speed else 0.0
            mav.aoa_ssa_send(1000 * boot_ms, math.degrees(math.atan2(-up, ahead)), math.degrees(slip))
        if self._intervals.is_due(mavlink.MAVLINK_MSG_ID_RAW_IMU, now_s) and sample.imu is not None:
            force = np.round(1e3 / G * sample.imu.specific_force * (1.0, -1.0, -1.0)).astype(int).tolist()
            turn = np.round(1e3 * sample.imu.angular_velocity * (1.0, -1.0, -1.0)).astype(int).tolist()
            mav.raw_imu_send(1000 * boot_ms, *force, *turn, 0, 0, 0)

    def _take(self, message: Any, now_s: float) -> None:
        kind = message.get_type()
        self.received[kind] = self.received.get(kind, 0) + 1
        self.parameters.take(message, self._link.mav)
        if kind == "HEARTBEAT" and message.get_srcSystem() == self.parameters.values[GROUND_SYSTEM]:
            self._ground_s = now_s
        elif kind == "SET_ATTITUDE_TARGET" and self._mode == GUIDED:
            self._aim(message, now_s)
        elif kind == "COMMAND_LONG":
            self._obey(message, now_s)

    def _aim(self, message: Any, now_s: float) -> None:
        """Take roll and pitch where the mask names them, and thrust where it does not leave it out."""
        given = ~message.type_mask
        yaw_too = given & IGNORE_ATTITUDE or given & 0b100
        if (given & 0b11 == 0b11 or given & IGNORE_ATTITUDE) and given & IGNORE_THRUST and not yaw_too:
            self.target, self._target_s = message, now_s

    def _see_loss(self, now_s: float) -> None:
        """Fly home without the heartbeats of the ground, where that failsafe is on and has seen one."""
        values = self.parameters.values
        seen = math.isfinite(self._ground_s)
        lost = now_s - self._ground_s > values["FS_LONG_TIMEOUT"]
        if values["FS_GCS_ENABL"] and values["FS_LONG_ACTN"] == 1 and seen and lost and self._mode == GUIDED:
            self.mode, self.failsafe = RTL, True

    def _obey(self, message: Any, now_s: float) -> None:
        mavlink = mavutil.mavlink
        result = mavlink.MAV_RESULT_ACCEPTED
        if message.command in self.denied:
            result = mavlink.MAV_RESULT_DENIED
            self._link.mav.statustext_send(
                mavlink.MAV_SEVERITY_CRITICAL, self.denied[message.command].encode()
            )
        elif message.command == mavlink.MAV_CMD_DO_SET_MODE:
            self.mode, self.failsafe = int(message.param2), False
        elif message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            self._intervals.ask(int(message.param1), 1e-6 * message.param2, now_s)
        else:
            result = mavlink.MAV_RESULT_UNSUPPORTED
        self._link.mav.command_ack_send(message.command, result)
