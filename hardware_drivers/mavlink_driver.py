"""Driver of a boat with ArduPilot, by MAVLink."""

from __future__ import annotations

import contextlib
import os
import threading
import time
from functools import partial
from typing import Any

# MAVLink 2 carries the messages that ArduPilot speaks today; pymavlink reads this when it is imported.
os.environ.setdefault("MAVLINK20", "1")

import numpy as np
from pymavlink import mavutil

from fulmar_core.errors import DeviceError
from fulmar_core.robot import Robot
from hardware_drivers.driver import DeviceDriver
from hardware_drivers.feedback import Feedback, Report
from hardware_drivers.mavlink_telemetry import Telemetry
from hardware_drivers.ports import patiently, write_at_once
from hardware_drivers.settings import UNARMED, MavlinkBoat
from hardware_drivers.wiring import bounded
from hardware_drivers.wiring import channels as wired

Address = tuple[int, int]  # system and component
HOST_SYSTEM, HOST_COMPONENT = 255, 190  # a ground station, which is whose overrides ArduPilot takes
HEARTBEAT_S = 1.0
NO_CHANGE = 65535  # of a channel in an override
RATES_HZ = {"ATTITUDE": 50.0, "LOCAL_POSITION_NED": 50.0, "RAW_IMU": 25.0}


class MavlinkDriver(DeviceDriver):
    """Drives by overriding two RC channels in MANUAL mode, measures by the autopilot's own estimate.

    Without `arm: true` in its settings it measures only: it sets no mode, arms nothing and sends no override.

    ArduPilot mixes steering and throttle into two motors: left is throttle + steering, right throttle - steering.
    """

    def __init__(self, robot: Robot, settings: MavlinkBoat, *, patience_s: float) -> None:
        """Open the link, wait for the autopilot, and ask for what is needed.

        Raises:
            DeviceError: No autopilot answers.
        """
        self._safe, self._settings = robot.actuators.safe_command, settings
        self._feedback = Feedback(f"autopilot at {settings.port}", settings.silent_s)
        self._telemetry = Telemetry()
        self._sending = threading.Lock()
        self._over = threading.Event()
        self._link = _opened(settings, patience_s)
        try:
            self._autopilot = _wait_for_autopilot(self._link, settings.port, patience_s)
            self._prepare()
        except OSError as error:
            self._link.close()
            raise DeviceError(f"autopilot at {settings.port}: the link is gone ({error}).") from error
        except DeviceError:
            self._link.close()
            raise
        self._thread = threading.Thread(target=self._run, name="mavlink reader", daemon=True)
        self._thread.start()
        try:
            self._feedback.wait(patience_s)
        except Exception:
            with contextlib.suppress(OSError):
                self.write(self._safe)
            self.close()
            raise

    def begin(self, x: float, y: float, heading: float) -> None:
        """Set the boat's position in `odom`, and arm if allowed; see `DeviceDriver`."""
        here = self._feedback.measured.position_in_world - self._telemetry.shift
        self._telemetry.shift = np.array([x, y, 0.0]) - here
        if self._settings.arm:
            self._drive(0.0, 0.0)
            self._command(mavutil.mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)

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

    def close(self) -> None:
        """Disarm, and close the link; see `DeviceDriver`."""
        try:
            if self._settings.arm:
                self._command(mavutil.mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0.0)
        except OSError:
            pass  # it is gone; the autopilot stops by its own failsafe
        finally:
            self._over.set()
            self._thread.join(0.5)
            self._link.close()

    def health(self) -> dict[str, str]:
        """Battery and arming; see `DeviceDriver`."""
        telemetry = self._telemetry
        warning = "" if telemetry.armed else "the autopilot is not armed: its propellers stand"
        if not self._settings.arm:
            warning = UNARMED
        return {"battery_v": telemetry.voltage, "armed": str(telemetry.armed).lower(), "warning": warning}

    def _prepare(self) -> None:
        mavlink = mavutil.mavlink
        for name, rate in RATES_HZ.items():
            kind = getattr(mavlink, f"MAVLINK_MSG_ID_{name}")
            self._command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, float(kind), 1e6 / rate)
        if not self._settings.arm:
            return
        manual = 0  # of ArduPilot's rover and boat modes
        self._command(
            mavlink.MAV_CMD_DO_SET_MODE, float(mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED), float(manual)
        )

    def _command(self, number: int, first: float, second: float = 0.0) -> None:
        link = self._link
        with self._sending:
            link.mav.command_long_send(*self._autopilot, number, 0, first, second, 0.0, 0.0, 0.0, 0.0, 0.0)

    def _drive(self, left: float, right: float) -> None:
        link, channels = self._link, override_of(self._settings, left, right)
        with self._sending:
            link.mav.rc_channels_override_send(*self._autopilot, *channels)

    def _run(self) -> None:
        beaten = 0.0
        while not self._over.is_set():
            now = time.monotonic()
            try:
                if now - beaten >= HEARTBEAT_S:
                    beaten = now
                    self._beat()
                message = self._link.recv_match(blocking=True, timeout=0.05)
                if message is not None and _sender(message) == self._autopilot:
                    report = self._telemetry.take(message, time.time_ns())
                    if report is not None:
                        self._feedback.put(report)
            except Exception as error:  # noqa: BLE001 - a thread that died in silence would look like a silent boat
                if not self._over.is_set():
                    self._feedback.fail(f"the link is gone ({type(error).__name__}: {error})")
                return

    def _beat(self) -> None:
        mavlink = mavutil.mavlink
        with self._sending:
            self._link.mav.heartbeat_send(
                mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0
            )


def _opened(settings: MavlinkBoat, patience_s: float) -> Any:
    """The link, as soon as it can be opened; raises DeviceError."""
    try:
        link = patiently(
            lambda: mavutil.mavlink_connection(
                settings.port,
                baud=settings.baud,
                source_system=HOST_SYSTEM,
                source_component=HOST_COMPONENT,
                autoreconnect=False,
                robust_parsing=True,
                retries=1,
            ),
            settings.port,
            patience_s,
        )
    except ValueError as error:
        raise DeviceError(f"{settings.port} cannot be opened: {error}.") from error
    if isinstance(link, (mavutil.mavserial, mavutil.mavtcp)):
        # pymavlink's own write waits forever on a serial port, and hides every failure.
        link.write = partial(write_at_once, link.fd)
    return link


def _wait_for_autopilot(link: Any, port: str, patience_s: float) -> Address:
    """Address of the first autopilot that sends a heartbeat; gimbals and ground stations send some, too.

    Raises:
        DeviceError: None in time.
    """
    until = time.monotonic() + patience_s
    while (left_s := until - time.monotonic()) > 0.0:
        heartbeat = link.recv_match(type="HEARTBEAT", blocking=True, timeout=left_s)
        if heartbeat is not None and heartbeat.autopilot != mavutil.mavlink.MAV_AUTOPILOT_INVALID:
            return _sender(heartbeat)
    raise DeviceError(f"autopilot at {port}: no heartbeat for {patience_s:g} s. Is it on?")


def _sender(message: Any) -> Address:
    return message.get_srcSystem(), message.get_srcComponent()


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
