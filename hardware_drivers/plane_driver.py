"""Driver of a fixed wing with ArduPlane, by MAVLink."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from fulmar_core.config.errors import DeviceError
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.command_end import CommandEnd
from fulmar_core.states.state import RigidBodyState
from hardware_drivers.driver import DeviceDriver
from hardware_drivers.feedback import Feedback, Report
from hardware_drivers.flight_set_points import FlightSetPoints
from hardware_drivers.mavlink_autopilot import BEATLESS_S, ERROR
from hardware_drivers.mavlink_parameters import Parameters
from hardware_drivers.mavlink_session import MavlinkSession
from hardware_drivers.mavlink_telemetry import Telemetry
from hardware_drivers.placed_reports import PlacedReports
from hardware_drivers.plane_air import PlaneAir
from hardware_drivers.plane_autopilot import GUIDED, LOITER, PlaneAutopilot, attitude_target, protection
from hardware_drivers.plane_settings import MavlinkPlane
from hardware_drivers.settings import UNARMED
from hardware_drivers.takeover import Doing, Takeover

HEARTBEAT_S = 0.5  # twice within the shortest time that ArduPlane takes for their loss
ANSWERS_S = 2.0  # for each parameter
AGAIN_S = 0.3  # a mode that does not show is asked for again after so long
STANDS_S = 0.15  # our value: positions of the same time for so long stand still
RATES_HZ = {
    "ATTITUDE": 50.0, "LOCAL_POSITION_NED": 50.0, "RAW_IMU": 25.0, "VFR_HUD": 10.0, "AOA_SSA": 10.0, "HEARTBEAT": 4.0,
}  # fmt: skip


class PlaneDriver(DeviceDriver):
    """Asks for roll, pitch and thrust in GUIDED mode, and measures by the autopilot's own estimate.

    It takes a craft over in flight with the first command. A decision, such as the e-stop, sets LOITER at once. After a
    silence set points and heartbeats stop, and ArduPlane's own failsafe acts. Without `arm: true` it only measures.
    """

    def __init__(self, robot: Robot, settings: MavlinkPlane, *, patience_s: float) -> None:
        """Open the link, wait for the autopilot, and set and check its failsafe where the driver may take over.

        Raises:
            ConfigError: The file with the key of its signatures cannot be used.
            DeviceError: No ArduPlane answers, or its failsafe cannot be confirmed.
        """
        self._robot, self._settings, self._safe = robot, settings, robot.actuators.safe_command
        self._feedback = Feedback(f"autopilot at {settings.port}", settings.silent_s)
        self._telemetry = Telemetry()
        self._plane, self._air = PlaneAutopilot(), PlaneAir(robot)
        self._reports = PlacedReports(self._feedback, robot.limits, turns_freely=True, flies=True)
        self._set_points = FlightSetPoints(robot, settings.lead_s)
        self._takeover = Takeover("the autopilot", "GUIDED", proof_s=0.0)
        self._end, self._begun, self._asked_s, self._began_s = (
            CommandEnd.WAITING,
            False,
            -1e9,
            time.monotonic(),
        )
        self._state: RigidBodyState | None = None
        self._newest_ms, self._newer_s = -1, time.monotonic()
        self._parameters: Parameters | None = None
        # In silence no heartbeats: without them ArduPlane's failsafe acts.
        self._session = MavlinkSession(
            settings, self._feedback, self._take,
            patience_s=patience_s, beat_s=HEARTBEAT_S, beats=lambda: self._end is not CommandEnd.SILENT,
        )  # fmt: skip
        with self._session.connecting():
            self._prepare()

    def take_end(self, end: CommandEnd) -> None:
        """See `TakesEnds`."""
        self._end = end

    def begin(self, x: float, y: float, heading: float) -> None:
        """Set the craft's position in `odom`; see `DeviceDriver`.

        Raises:
            DeviceError: It is not armed, and this driver takes over in flight.
        """
        self._reports.begin(x, y)
        if not self._settings.arm:
            return
        if not self._plane.armed:
            words = self._plane.words(time.monotonic())
            says = f" It says {words}." if words else ""
            raise DeviceError(
                f"{self._session.name}: it is not armed, in mode {self._plane.mode_name}, and this driver takes over "
                f"in flight: take off in a mode of its own, then start it.{says}"
            )
        self._begun = True

    def write(self, command: np.ndarray) -> np.ndarray | None:
        """Ask for what deflections and throttles would do; sends nothing if it must not take over."""
        if not self._begun:
            return self._safe
        now_s = time.monotonic()
        doing = self._takeover.doing(self._end, self._plane.mode == GUIDED, now_s)
        if doing is Doing.HOLD:
            self._ask(LOITER)
        elif doing is Doing.ASK:
            self._ask(GUIDED)
        elif doing is Doing.FLY:
            assert self._state is not None  # as of the first report
            point = self._set_points.of(self._state, command)
            session, since_ms = self._session, round(1e3 * (now_s - self._began_s))
            session.link.send(attitude_target(point, since_ms, session.autopilot))
            return None
        return self._safe

    def read(self) -> Report:
        """See `DeviceDriver`."""
        return self._feedback.read()

    def refusal(self) -> str:
        """See `Answering`."""
        plane, now_s = self._plane, time.monotonic()
        if not self._begun:
            return ""
        if plane.beaten_before_s(now_s) > BEATLESS_S:
            return f"the autopilot has sent no heartbeat for {BEATLESS_S:g} s: its mode is not known"
        if plane.stranger:
            return f"the autopilot is {plane.stranger}: what its modes mean is not known"
        if not plane.armed:
            return "the autopilot is not armed: it does not fly"
        answer = self._session.commands.refused if self._session.commands else ""
        return self._takeover.refusal(
            self._end, plane.mode == GUIDED, now_s, mode=plane.mode_name, answer=answer
        )

    def health(self) -> dict[str, str]:
        """Battery, mode, arming and words of the autopilot; see `DeviceDriver`."""
        now_s, plane = time.monotonic(), self._plane
        said = plane.words(now_s, worst=ERROR)
        warning = (
            self._feedback.refusal
            or (UNARMED if not self._settings.arm else self.refusal())
            or ("a failsafe of the autopilot acts" if plane.failsafe else "")
            or (f"the autopilot says {said}" if said else "")
        )
        measured = {"battery_v": self._telemetry.voltage, "airspeed_m_s": self._air.airspeed_words}
        known = self._session.health(plane, refused_positions=self._reports.refused)
        return {**measured, **known, "warning": warning}

    def close(self) -> None:
        """Set LOITER where the driver has the craft, and close the link; see `DeviceDriver`."""
        try:
            if self._begun and self._plane.mode == GUIDED:
                self._set_mode(LOITER)
        except OSError:
            pass  # it is gone; the autopilot flies on by its own failsafe
        finally:
            self._session.close()

    def _prepare(self) -> None:
        """Ask for telemetry, and set and check the failsafe where the driver may take over."""
        session = self._session
        self._parameters = Parameters(session.link.send, session.autopilot, bytewise=False)
        session.ask_for(RATES_HZ)
        if not self._settings.arm:
            return
        session.await_heartbeat(self._plane)
        if self._plane.stranger:
            raise DeviceError(
                f"{session.name}: the autopilot is {self._plane.stranger}. Nothing is set or taken over."
            )
        problem = self._parameters.protect(protection(self._settings), ANSWERS_S)
        if problem:
            raise DeviceError(f"{session.name}: {problem}. Nothing is taken over.")

    def _ask(self, mode: int) -> None:
        now_s = time.monotonic()
        if now_s - self._asked_s >= AGAIN_S:
            self._asked_s = now_s
            self._set_mode(mode)

    def _set_mode(self, mode: int) -> None:
        commands = self._session.commands
        assert commands is not None
        custom = float(mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED)
        commands.tell(mavlink.MAV_CMD_DO_SET_MODE, custom, float(mode))

    def _take(self, message: Any) -> None:
        """Take a message of the autopilot."""
        self._plane.take(message, time.monotonic())
        if self._parameters is not None:
            self._parameters.take(message)
        self._air.take(message)
        report = self._telemetry.take(message, time.time_ns())
        if report is None or report.odometry is None or self._stands_still(message):
            return
        self._state = report.odometry
        others = self._air.readings(report.odometry, report.stamp_ns)
        imu = report.imu if "imu" in self._robot.sensors.specs else None
        self._reports.take(replace(report, imu=imu, others=others))

    def _stands_still(self, message: Any) -> bool:
        """Whether a position is of the same time as the one before."""
        now_s = time.monotonic()
        if message.time_boot_ms != self._newest_ms:
            self._newest_ms, self._newer_s = message.time_boot_ms, now_s
            return False
        if now_s - self._newer_s > STANDS_S:
            self._feedback.refuse("its position has the same time again and again: it stands still")
        return True
