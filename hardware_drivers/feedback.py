"""The newest that a device has said of itself, handed from the thread that reads to the one that steps."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass

from fulmar_core.errors import DeviceError
from fulmar_core.sensors.imu import ImuSample
from fulmar_core.state import RigidBodyState


@dataclass(frozen=True)
class Report:
    """One measurement of a device."""

    odometry: RigidBodyState
    imu: ImuSample | None
    stamp_ns: int  # when it was captured, since the epoch [ns]


class Feedback:
    """Newest report, and how long ago it came."""

    def __init__(self, device: str, silent_s: float) -> None:
        """Begin with none.

        Args:
            device: What it is, for messages.
            silent_s: A device that says nothing for so long is gone [s].
        """
        self._device, self._silent_ns = device, round(silent_s * 1e9)
        self._changed = threading.Condition()
        self._newest: Report | None = None
        self._came_ns = 0
        self._failure = ""

    def put(self, report: Report) -> None:
        """A report has come; from the thread that reads."""
        with self._changed:
            self._newest, self._came_ns = report, time.monotonic_ns()
            self._changed.notify_all()

    def fail(self, reason: str) -> None:
        """No report will come any more; from the thread that reads."""
        with self._changed:
            self._failure = reason
            self._changed.notify_all()

    def wait(self, timeout_s: float) -> None:
        """Wait for the first report.

        Raises:
            DeviceError: If none comes in time.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._newest is not None or self._failure, timeout_s)
            if self._newest is None:
                why = self._failure or f"said nothing that can be read for {timeout_s:g} s"
                raise DeviceError(
                    f"{self._device}: {why}. Is it switched on, and is this the right port and baud rate?"
                )

    @property
    def newest(self) -> Report:
        """The newest report; there must be one."""
        with self._changed:
            assert self._newest is not None
            return self._newest

    def read(self) -> Report:
        """The newest report, if it is young enough.

        Raises:
            DeviceError: The device is gone.
        """
        with self._changed:
            newest, age_ns, failure = self._newest, time.monotonic_ns() - self._came_ns, self._failure
        if failure:
            raise DeviceError(f"{self._device}: {failure}")
        if newest is None or age_ns > self._silent_ns:
            raise DeviceError(
                f"{self._device}: no report for {age_ns / 1e6:.0f} ms "
                f"(limit {self._silent_ns / 1e6:.0f} ms). Is the cable in, and the device on?"
            )
        return newest
