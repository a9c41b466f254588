"""Driver of a Kobuki base."""

from __future__ import annotations

import contextlib
import math
import time

import numpy as np

from fulmar_core.robots.actuators.differential_drive import DifferentialDrive
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.imu import ImuSample
from hardware_drivers.driver import DeviceDriver
from hardware_drivers.feedback import DeviceTime, Feedback, Report
from hardware_drivers.kobuki_protocol import (
    COUNT,
    WHEEL_RADIUS,
    WRAP_MS,
    CoreSensors,
    Decoder,
    Inertia,
    base_control,
)
from hardware_drivers.ports import Reader, open_port
from hardware_drivers.settings import Kobuki
from hardware_drivers.wheel_odometry import StalledWheels, WheelOdometry
from hardware_drivers.wiring import channel_velocity

LOW_BATTERY = 13.2  # [V]: kobuki_node calls it dangerous
LIFTED_S = 1.0  # our value: on a threshold a wheel hangs for less
ABSENT = np.full(3, np.nan)  # the base has no accelerometer


class KobukiDriver(DeviceDriver):
    """Drives by base control, measures by encoders and gyroscope.

    While a bumper or a cliff sensor answers, the base stands, or backs off straight; while a wheel hangs in the air, it
    stands. One that was lifted does not drive off as soon as it is put down.
    """

    def __init__(self, robot: Robot, settings: Kobuki, *, patience_s: float) -> None:
        """Open the port and wait for the first report.

        Raises:
            DeviceError: Nothing is there, or it does not speak Kobuki's protocol.
        """
        self._wheels, self._wiring = robot.actuated_by(DifferentialDrive), settings.wiring
        self._feedback = Feedback(f"Kobuki base at {settings.port}", settings.silent_s)
        self._decoder, self._time = Decoder(), DeviceTime(WRAP_MS)
        self._odometry = WheelOdometry(COUNT * WHEEL_RADIUS)
        self._fastest = robot.limits.speed + 0.5 * self._wheels.track * robot.limits.yaw_rate  # rim [m/s]
        self._jumps = 0
        self._standing = StalledWheels()
        self._begin: tuple[float, float, float] | None = None
        self._core: CoreSensors | None = None
        self._lifted_s: float | None = None  # since when a wheel has hung in the air
        self._sent = robot.actuators.safe_command
        self._port = open_port(settings.port, settings.baud, patience_s)
        self._reader = Reader(self._port, self._take, self._feedback.fail)
        try:
            self._feedback.wait(patience_s)
        except Exception:
            with contextlib.suppress(OSError):
                self.write(robot.actuators.safe_command)
            self.close()
            raise

    def begin(self, x: float, y: float, heading: float) -> None:
        """Take a pose for where the base stands; see `DeviceDriver`."""
        self._begin = (x, y, heading)  # taken by the reading thread
        deadline = time.monotonic() + 1.0
        while self._awaits_report() and time.monotonic() < deadline:
            time.sleep(0.002)

    def write(self, command: np.ndarray) -> np.ndarray:
        """Send a command, or a stop where something is in the way; see `DeviceDriver`."""
        self._sent = self._allowed(command)
        speed, turn_rate = (float(value) for value in self._sent)
        self._port.write(base_control(*channel_velocity(self._wiring, self._wheels.track, speed, turn_rate)))
        return self._sent

    def read(self) -> Report:
        """See `DeviceDriver`."""
        return self._feedback.read()

    def refusal(self) -> str:
        """Whether the base is lifted; see `Answering`."""
        lifted_s = self._lifted_s
        if lifted_s is None or time.monotonic() - lifted_s < LIFTED_S:
            return ""
        return "a wheel of the base hangs in the air: it was lifted, and its odometry does not know where to"

    def close(self) -> None:
        """Close the port; see `DeviceDriver`."""
        self._reader.stop()

    def health(self) -> dict[str, str]:
        """Battery and what touches; see `DeviceDriver`."""
        core = self._core
        if core is None:
            return {}
        warning = _touched(core) or self._feedback.refusal or _strained(core)
        return {
            "battery_v": f"{core.battery:.1f}",
            "bumpers": str(core.bumpers),
            "cliffs": str(core.cliffs),
            "wheel_drops": str(core.wheel_drops),
            "overcurrent": str(core.overcurrent),
            "lost_bytes": str(self._decoder.lost),
            "refused_reports": str(self._jumps),
            "warning": warning,
        }

    def _awaits_report(self) -> bool:
        return self._begin is not None

    def _allowed(self, command: np.ndarray) -> np.ndarray:
        core = self._core
        if core is None or core.wheel_drops:
            return np.zeros(2)
        if core.bumpers or core.cliffs:
            return np.array([min(0.0, command[0]), 0.0])
        return command

    def _take(self, data: bytes) -> None:
        now_ns = time.time_ns()
        for packet in self._decoder.feed(data):
            if packet.core is not None:
                self._core = packet.core
                if not packet.core.wheel_drops:
                    self._lifted_s = None
                elif self._lifted_s is None:
                    self._lifted_s = time.monotonic()
            if packet.core is not None and packet.inertia is not None:
                self._report(packet.core, packet.inertia, now_ns)

    def _report(self, core: CoreSensors, inertia: Inertia, now_ns: int) -> None:
        begin, stamp_ns = self._begin, self._time.stamp_ns(core.time_ms, now_ns)
        if begin is not None:
            self._odometry.begin(*begin)
        if problem := self._odometry.problem(core.left, core.right, stamp_ns / 1e9, self._fastest):
            self._jumps += 1
            self._feedback.refuse(problem)
            return
        rims = self._wheels.wheel_speeds(self._sent) * WHEEL_RADIUS
        if problem := self._standing.problem(rims, np.array((core.left, core.right)), stamp_ns / 1e9):
            self._feedback.fail(problem)
        rate = math.radians(inertia.rate)
        gyro = math.radians(inertia.angle)
        state = self._odometry.see(core.left, core.right, gyro, rate, stamp_ns / 1e9)
        imu = ImuSample(ABSENT, np.array([0.0, 0.0, rate]))
        self._feedback.put(Report(state, imu, stamp_ns))
        if begin is not None:
            self._begin = None  # after the report, so that a waiting thread reads the new pose


def _touched(core: CoreSensors) -> str:
    if core.wheel_drops:
        return "a wheel hangs in the air: the base stands"
    if core.cliffs:
        return "a cliff sensor sees no floor: the base only backs off"
    if core.bumpers:
        return "a bumper is pressed: the base only backs off"
    return ""


def _strained(core: CoreSensors) -> str:
    if core.overcurrent:
        return "a wheel draws too much current: is it blocked?"
    return f"battery at {core.battery:.1f} V" if core.battery < LOW_BATTERY else ""
