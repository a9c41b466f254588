"""Driver of a Kingfisher."""

from __future__ import annotations

import contextlib
import math
import time

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.states.state import RigidBodyState
from hardware_drivers import kingfisher_protocol as protocol
from hardware_drivers.driver import DeviceDriver
from hardware_drivers.earth_frame import LocalFrame, attitude
from hardware_drivers.feedback import DeviceTime, Feedback, Report
from hardware_drivers.kingfisher_protocol import Decoder
from hardware_drivers.placed_reports import PlacedReports
from hardware_drivers.ports import Reader, open_port
from hardware_drivers.settings import KingfisherNmea
from hardware_drivers.wiring import channels

DAY_MS = 86_400_000


class KingfisherDriver(DeviceDriver):
    """Drives by `$PYDIR`, measures by `$CPNVG`, `$CPNVR` and `$CPIMU`."""

    def __init__(self, robot: Robot, settings: KingfisherNmea, *, patience_s: float) -> None:
        """Open the port and wait for the first fix.

        Raises:
            DeviceError: Nothing is there, or it has no fix.
        """
        self._settings = settings
        self._feedback = Feedback(f"boat at {settings.port}", settings.silent_s)
        self._reports = PlacedReports(self._feedback, robot.limits)
        self._decoder, self._time = Decoder(), DeviceTime(DAY_MS)
        origin = settings.origin
        self._frame = LocalFrame(origin.latitude, origin.longitude) if origin else None
        self._rates: protocol.Rates | None = None
        self._imu: ImuSample | None = None
        self._voltage = ""
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
        """Without an origin, set the boat's position in `odom`; see `DeviceDriver`."""
        if self._settings.origin is None:
            self._reports.begin(x, y)

    def write(self, command: np.ndarray) -> None:
        """Send a command; see `DeviceDriver`."""
        left, right = channels(self._settings.wiring, float(command[0]), float(command[1]))
        self._port.write(protocol.drive(left, right))

    def read(self) -> Report:
        """See `DeviceDriver`."""
        return self._feedback.read()

    def close(self) -> None:
        """Close the port; see `DeviceDriver`."""
        self._reader.stop()

    def health(self) -> dict[str, str]:
        """Battery, lost sentences and refused positions; see `DeviceDriver`."""
        return {
            "battery_v": self._voltage,
            "lost_sentences": str(self._decoder.lost),
            "refused_positions": str(self._reports.refused),
            "warning": self._feedback.refusal,
        }

    def _take(self, data: bytes) -> None:
        now_ns = time.time_ns()
        for fields in self._decoder.feed(data):
            message = protocol.read(fields)
            if isinstance(message, protocol.Rates):
                self._rates = message
            elif isinstance(message, protocol.Inertial):
                self._imu = message.reading
            elif isinstance(message, protocol.Battery):
                self._voltage = f"{message.voltage:.1f}"
            elif isinstance(message, protocol.NoFix):
                self._feedback.refuse("the boat has no fix of its position")
            elif isinstance(message, protocol.Fix):
                self._report(message, now_ns)

    def _report(self, fix: protocol.Fix, now_ns: int) -> None:
        rates = self._rates
        # Velocities come in another sentence; without recent ones there is no state to report.
        if rates is None or abs(fix.time_s - rates.time_s) > protocol.OLDEST_SPEED_S:
            return
        if self._frame is None:
            self._frame = LocalFrame(fix.latitude, fix.longitude)
        east, north = self._frame.metres(fix.latitude, fix.longitude)
        turn = np.array([0.0, 0.0, -math.radians(rates.yaw_rate)])
        state = RigidBodyState(
            np.array([east, north, 0.0]),
            attitude(*(math.radians(angle) for angle in (fix.roll, fix.pitch, fix.heading))),
            np.array([rates.east, rates.north, 0.0]),
            turn,
        )
        self._reports.take(Report(state, self._imu, self._time.stamp_ns(1e3 * fix.time_s, now_ns)))
