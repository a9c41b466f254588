"""Driver of a boat with ArduPilot, by MAVLink."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from fulmar_core.config.errors import DeviceError
from fulmar_core.robots.robot import Robot
from hardware_drivers.driver import DeviceDriver
from hardware_drivers.feedback import Feedback, Report
from hardware_drivers.mavlink_autopilot import ERROR, MANUAL, Autopilot
from hardware_drivers.mavlink_session import MavlinkSession
from hardware_drivers.mavlink_telemetry import Telemetry
from hardware_drivers.placed_reports import PlacedReports
from hardware_drivers.settings import UNARMED, MavlinkBoat
from hardware_drivers.wiring import bounded
from hardware_drivers.wiring import channels as wired

HEARTBEAT_S = 1.0
OBEYS_S = 3.0  # for a mode or the arming to show in a heartbeat, of which there is one a second
NO_CHANGE = 65535  # of a channel in an override
RATES_HZ = {
    "ATTITUDE": 50.0,
    "LOCAL_POSITION_NED": 50.0,
    "RAW_IMU": 25.0,
    "RC_CHANNELS": 5.0,
    "HEARTBEAT": 4.0,
}


class MavlinkDriver(DeviceDriver):
    """Drives by overriding two RC channels in MANUAL mode, measures by the autopilot's own estimate.

    Without `arm: true` in its settings it measures only: it sets no mode, arms nothing and sends no override.

    ArduPilot mixes steering and throttle into two motors: left is throttle + steering, right throttle - steering.
    """

    def __init__(self, robot: Robot, settings: MavlinkBoat, *, patience_s: float) -> None:
        """Open the link, wait for the autopilot, ask for what is needed, and set MANUAL where it may be armed.

        Raises:
            ConfigError: The file with the key of its signatures cannot be used.
            DeviceError: No autopilot answers, or it does not go to MANUAL.
        """
        self._safe, self._settings = robot.actuators.safe_command, settings
        self._feedback = Feedback(f"autopilot at {settings.port}", settings.silent_s)
        self._telemetry = Telemetry()
        self._state = Autopilot(settings.steering_channel, settings.throttle_channel)
        self._reports = PlacedReports(self._feedback, robot.limits)
        self._has_begun = False
        self._session = MavlinkSession(
            settings, self._feedback, self._take, patience_s=patience_s, beat_s=HEARTBEAT_S
        )
        with self._session.connecting(self._release):
            self._prepare()

    def begin(self, x: float, y: float, heading: float) -> None:
        """Set the boat's position in `odom`, and arm if allowed; see `DeviceDriver`.

        Raises:
            DeviceError: It left MANUAL, or refuses to arm.
        """
        self._reports.begin(x, y)
        if not self._settings.arm:
            return
        if self._state.mode != MANUAL:
            raise DeviceError(
                f"{self._session.name}: it is in mode {self._state.mode_name}, not MANUAL. Nothing is armed."
            )
        self._drive(0.0, 0.0)
        self._demand(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0, what="arming", done=lambda: self._state.armed)
        self._has_begun = True

    def write(self, command: np.ndarray) -> np.ndarray:
        """Send a command; sends nothing if the boat must not be armed. See `DeviceDriver`."""
        if not self._settings.arm:
            return self._safe
        left, right = (float(share) for share in command)
        self._drive(left, right)
        return command

    def read(self) -> Report:
        """See `DeviceDriver`."""
        return self._feedback.read()

    def refusal(self) -> str:
        """Why overrides do nothing; see `Answering`."""
        return self._state.refusal(time.monotonic()) if self._has_begun else ""

    def close(self) -> None:
        """Disarm, and close the link; see `DeviceDriver`."""
        try:
            self._release()
        except OSError:
            pass  # it is gone; the autopilot stops by its own failsafe
        finally:
            self._session.close()

    def health(self) -> dict[str, str]:
        """Battery, mode, arming and words of the autopilot; see `DeviceDriver`."""
        now_s, state = time.monotonic(), self._state
        said = state.words(now_s, worst=ERROR)
        unarmed = UNARMED if not self._settings.arm else state.refusal(now_s)
        warning = (
            self._feedback.refusal
            or unarmed
            or ("a failsafe of the autopilot acts" if state.failsafe else "")
            or (f"the autopilot says {said}" if said else "")
        )
        known = self._session.health(state, refused_positions=self._reports.refused)
        return {"battery_v": self._telemetry.voltage, **known, "warning": warning}

    def _prepare(self) -> None:
        """Ask for telemetry, and set MANUAL where the boat may be armed."""
        self._session.ask_for(RATES_HZ)
        if not self._settings.arm:
            return
        self._session.await_heartbeat(self._state)
        self._demand(
            mavlink.MAV_CMD_DO_SET_MODE,
            float(mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED),
            float(MANUAL),
            what="mode MANUAL",
            done=lambda: self._state.mode == MANUAL,
        )

    def _demand(
        self, number: int, first: float, second: float = 0.0, *, what: str, done: Callable[[], bool]
    ) -> None:
        """Command the autopilot until a heartbeat from now on shows the effect.

        Raises:
            DeviceError: It does not, with the autopilot's own words.
        """
        commands = self._session.commands
        assert commands is not None
        if self._state.stranger:
            raise DeviceError(
                f"{self._session.name}: the autopilot is {self._state.stranger}. Nothing is set or armed."
            )
        beats = self._state.beats
        reason = commands.ask(
            number, first, second, done=lambda: self._state.beats > beats and done(), within_s=OBEYS_S
        )
        if reason:
            words = self._state.words(time.monotonic())
            says = f" It says {words}." if words else ""
            raise DeviceError(
                f"{self._session.name} refuses {what}: {reason}; it is in mode {self._state.mode_name}.{says}"
            )

    def _release(self) -> None:
        """Stop and disarm a boat that may be armed, and send nothing to a stranger; raises OSError."""
        commands = self._session.commands
        if self._settings.arm and commands is not None and not self._state.stranger:
            self._drive(0.0, 0.0)
            commands.tell(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0.0)

    def _drive(self, left: float, right: float) -> None:
        settings = self._settings
        channels = override_of(settings, left, right)
        pulses = channels[settings.steering_channel - 1], channels[settings.throttle_channel - 1]
        self._state.note_sent(*pulses, time.monotonic())
        session = self._session
        session.link.send(mavlink.MAVLink_rc_channels_override_message(*session.autopilot, *channels))

    def _take(self, message: object) -> None:
        """Take a message of the autopilot."""
        self._state.take(message, time.monotonic())
        report = self._telemetry.take(message, time.time_ns())
        if report is not None:
            self._reports.take(report)


def override_of(settings: MavlinkBoat, left: float, right: float) -> list[int]:
    """Pulses of eight RC channels that make the propellers turn [µs].

    Args:
        settings: Which channels, and how far.
        left: Share of full thrust, -1 to 1; see `bounded`.
        right: Same.
    """
    left, right = wired(settings.wiring, *bounded(left, right))
    channels = [NO_CHANGE] * 8
    shares = {
        settings.steering_channel: 0.5 * (left - right),
        settings.throttle_channel: 0.5 * (left + right),
    }
    for channel, share in shares.items():
        channels[channel - 1] = settings.trim_us + round(settings.span_us * share)
    return channels
