"""Drivers of PX4 by px4_msgs: what both have, and thrusters of a free flyer by direct actuators."""

from __future__ import annotations

import math
import time
from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np

from fulmar_core.config.errors import DeviceError
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.safety.command_end import CommandEnd
from fulmar_core.states.state import RigidBodyState
from hardware_drivers.driver import DeviceDriver
from hardware_drivers.feedback import DeviceTime, Feedback, Report
from hardware_drivers.placed_reports import PlacedReports
from hardware_drivers.px4_failsafe import confirm_parameters
from hardware_drivers.px4_messages import imu_of, odometry_of
from hardware_drivers.px4_offboard import ARM_DISARM, Offboard, Px4Link, now_us
from hardware_drivers.px4_settings import BY_SILENCE, MOTORS, SERVOS, Px4, Px4Thrusters
from hardware_drivers.px4_vehicle import Px4Vehicle
from hardware_drivers.settings import UNARMED

HINT = "Do PX4 and the uXRCE-DDS agent run, in this ROS domain and under the namespace `topics` of the hardware file?"
SYNCED_NS = 500_000_000  # a time stamp nearer to our clock than this is by our clock
SLOW_US = 20_000  # of an exchange of clocks, beyond which the time of measurements is worth a warning
STANDS_S = 0.15  # our value: odometry of the same time for so long stands still


class Px4Driver(DeviceDriver):
    """Measures by VehicleOdometry and SensorCombined, and knows PX4's mode; see the classes below for commands.

    `odom` is PX4's local frame, turned to east-north-up. Without `arm: true` the driver receives, and sends nothing.
    """

    def __init__(
        self, robot: Robot, settings: Px4, link: Px4Link, *, controls: str, patience_s: float
    ) -> None:
        """Wait for odometry and status, and confirm the failsafe where the driver may arm.

        Raises:
            DeviceError: PX4 is not there, or its failsafe cannot be confirmed.
        """
        self._safe, self._settings, self._link = robot.actuators.safe_command, settings, link
        self._has_imu = "imu" in robot.sensors.specs
        self._feedback = Feedback("PX4", settings.silent_s, hint=HINT)
        self._reports = PlacedReports(self._feedback, robot.limits, turns_freely=not robot.body.planar)
        self._vehicle = Px4Vehicle()
        self._offboard = Offboard(link, self._vehicle, controls, settings.system)
        self._time, self._measured_us = DeviceTime(), -1
        self._imu: ImuSample | None = None
        self._newer_s = time.monotonic()
        self._end = CommandEnd.WAITING
        self._state: RigidBodyState | None = None  # newest odometry
        self._begun = False
        link.listen(self._take)
        try:
            self._feedback.wait(patience_s)
            self._await_status(patience_s)
            if settings.arm:
                confirm_parameters(settings.failsafe, patience_s)
        except BaseException:
            link.close()
            raise

    def take_end(self, end: CommandEnd) -> None:
        """See `TakesEnds`."""
        self._end = end

    def read(self) -> Report:
        """See `DeviceDriver`."""
        return self._feedback.read()

    def health(self) -> dict[str, str]:
        """Mode, arming and clock of PX4; see `DeviceDriver`."""
        vehicle, now_s = self._vehicle, time.monotonic()
        slow = vehicle.round_trip_us > SLOW_US
        warning = (
            self._feedback.refusal
            or (UNARMED if not self._settings.arm else self.refusal())
            or ("PX4 has sent no status lately" if vehicle.is_stale(now_s) else "")
            or ("a failsafe of PX4 acts" if vehicle.failsafe else "")
            or (f"PX4's exchange of clocks takes {vehicle.round_trip_us / 1000:.0f} ms" if slow else "")
        )
        return {
            "armed": str(vehicle.armed).lower(),
            "autopilot_mode": vehicle.mode_name,
            "clock_offset_us": "" if vehicle.offset_us is None else str(vehicle.offset_us),
            "refused_commands": vehicle.refused,
            "refused_positions": str(self._reports.refused),
            "warning": warning,
        }

    @abstractmethod
    def refusal(self) -> str:
        """Why PX4 does not carry out set points; see `Answering`."""

    def _await_status(self, patience_s: float) -> None:
        end_s = time.monotonic() + patience_s
        while self._vehicle.nav_state is None:
            if time.monotonic() > end_s:
                raise DeviceError(f"PX4 sends odometry, and no VehicleStatus for {patience_s:g} s. {HINT}")
            self._vehicle.wait(0.05)

    def _take(self, kind: str, message: Any) -> None:
        """Take a message; called from the link's thread."""
        self._vehicle.take(kind, message, time.monotonic())
        if kind == "SensorCombined":
            self._imu = imu_of(message)
        elif kind == "VehicleOdometry":
            self._measure(message)

    def _measure(self, message: Any) -> None:
        now_s, sampled_us = time.monotonic(), int(message.timestamp_sample or message.timestamp)
        if sampled_us == self._measured_us:
            if now_s - self._newer_s > STANDS_S:
                self._feedback.refuse(
                    "its odometry has the same time of measurement again and again: it stands still"
                )
            return
        self._measured_us, self._newer_s = sampled_us, now_s
        state, problem = odometry_of(message)
        if state is None:
            self._feedback.refuse(problem)
            return
        stamp_ns = self._stamp_ns(sampled_us, time.time_ns())
        self._state = state
        self._reports.take(Report(state, self._imu if self._has_imu else None, stamp_ns))

    def _stamp_ns(self, sampled_us: int, now_ns: int) -> int:
        """When a measurement was made, since the epoch [ns]; PX4's client writes our time where it knows it."""
        if abs(1000 * sampled_us - now_ns) < SYNCED_NS:
            return min(1000 * sampled_us, now_ns)
        return self._time.stamp_ns(1e-3 * sampled_us, now_ns)


class Px4ThrusterDriver(Px4Driver):
    """Opens thrusters by ActuatorMotors, and by ActuatorServos beyond twelve.

    Where commands end by a decision, as under the e-stop, thrusters are closed and the stream goes on. Where commands
    fall silent, they are closed and the stream stops, so that PX4's own failsafe disarms.
    """

    def __init__(self, robot: Robot, settings: Px4Thrusters, link: Px4Link, *, patience_s: float) -> None:
        """See `Px4Driver`."""
        super().__init__(robot, settings, link, controls="direct_actuator", patience_s=patience_s)
        self._order, self._failsafe = list(settings.order), settings.failsafe

    def begin(self, x: float, y: float, heading: float) -> None:
        """Enter offboard mode and arm, with closed thrusters; see `DeviceDriver`.

        Raises:
            DeviceError: PX4 refuses, or does not disarm when the stream stops.
        """
        if not self._settings.arm:
            return
        self._actuate(self._safe)
        self._offboard.prove()
        self._offboard.enter()
        if self._failsafe.confirm == BY_SILENCE:
            self._actuate(self._safe)
            self._offboard.rehearse_loss(self._failsafe.loss_s)
            self._offboard.prove()
            self._offboard.enter()
        self._begun = True

    def write(self, command: np.ndarray) -> np.ndarray:
        """Send shares of full thrust; sends nothing if PX4 must not be armed. See `DeviceDriver`."""
        if not self._settings.arm:
            return self._safe
        wanted = command if self._end in (CommandEnd.NONE, CommandEnd.WAITING) else self._safe
        if self._end is not CommandEnd.SILENT:
            self._offboard.stream()
        self._actuate(wanted)
        return wanted

    def refusal(self) -> str:
        """See `Answering`; a PX4 that has disarmed is not armed again."""
        vehicle = self._vehicle
        if not self._begun:
            return ""
        if vehicle.is_stale(time.monotonic()):
            return "PX4 has sent no status for 2.5 s: its mode is not known"
        if not vehicle.armed:
            return "PX4 is not armed: its thrusters are closed"
        if not vehicle.offboard:
            return f"PX4 is in mode {vehicle.mode_name}, not OFFBOARD: it takes no set points"
        return ""

    def close(self) -> None:
        """Close the thrusters, disarm, and release the link; see `DeviceDriver`."""
        try:
            if self._settings.arm:
                self._actuate(self._safe)
                self._offboard.command(ARM_DISARM, 0.0)
        finally:
            self._link.close()

    def _actuate(self, command: np.ndarray) -> None:
        motors, servos = controls_of(command, self._order)
        stamps = {"timestamp": now_us(), "timestamp_sample": max(self._measured_us, 0)}
        self._link.send("ActuatorMotors", {**stamps, "reversible_flags": 0, "control": motors})
        if len(self._order) > MOTORS:
            self._link.send("ActuatorServos", {**stamps, "control": servos})


def controls_of(command: np.ndarray, order: Sequence[int]) -> tuple[list[float], list[float]]:
    """Controls of motors and servos for openings of thrusters.

    Args:
        command: Shares of full thrust from 0 to 1, shape (n,); all thrusters close if one is not finite.
        order: Which thruster, counted from 0, each output opens: motors first, servos beyond twelve.

    Returns:
        Twelve of motors, from 0 to 1, and eight of servos, where -1 is closed and 1 is open. Outputs without a thruster
        are NaN, which PX4 takes for disarmed.
    """
    shares = np.asarray(command, dtype=float)
    shares = np.clip(shares, 0.0, 1.0) if np.isfinite(shares).all() else np.zeros_like(shares)
    opened = [float(shares[thruster]) for thruster in order]
    motors, beyond = opened[:MOTORS], [2.0 * share - 1.0 for share in opened[MOTORS:]]
    return motors + [math.nan] * (MOTORS - len(motors)), beyond + [math.nan] * (SERVOS - len(beyond))
