"""Newest report of a device, from the reading thread to the stepping one, and its time in the host's clock."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field

from fulmar_core.config.errors import DeviceError
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.reading import Reading


@dataclass(frozen=True)
class Report:
    """What a device measured at one instant.

    Raises:
        ValueError: `others` has odometry or IMU, which have fields of their own.
    """

    odometry: RigidBodyState | None  # None: another node measures it
    imu: ImuSample | None
    stamp_ns: int  # when it was captured, since the epoch [ns]
    # Of other sensors, by their names in the robot's YAML. One with a stamp of its own is published once.
    others: Mapping[str, Reading] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if twice := {"odometry", "imu"} & set(self.others):
            raise ValueError(f"'{min(twice)}' is a field of a report of its own: Report({min(twice)}=...).")

    @property
    def readings(self) -> dict[str, Reading]:
        """Readings of every sensor, by name."""
        own = {"odometry": self.odometry, "imu": self.imu}
        return {name: Reading(value) for name, value in own.items() if value is not None} | dict(self.others)


class Feedback:
    """Newest report of a device, and its age."""

    def __init__(self, device: str, silent_s: float, *, hint: str = "") -> None:
        """Begin with none.

        Args:
            device: Its name, for messages.
            silent_s: A device without a report for so long is gone [s].
            hint: What to look at when it is silent; cable, switch, port and baud rate by default.
        """
        self._device, self._silent_ns, self._hint = device, round(silent_s * 1e9), hint
        self._refused, self._refusal = 0, ""
        self._changed = threading.Condition()
        self._newest: Report | None = None
        self._came_ns = 0
        self._failure = ""

    def put(self, report: Report) -> None:
        """Store a report; called by the reading thread."""
        with self._changed:
            self._newest, self._came_ns = report, time.monotonic_ns()
            self._refused, self._refusal = 0, ""
            self._changed.notify_all()

    def refuse(self, reason: str) -> None:
        """Count a report that cannot be believed; a device that sends no other is silent, and says why."""
        with self._changed:
            self._refused, self._refusal = self._refused + 1, reason

    @property
    def refusal(self) -> str:
        """Why the last report was refused; empty where a good one came after it."""
        with self._changed:
            return self._refusal

    def fail(self, reason: str) -> None:
        """End the reports with a reason; called by the reading thread."""
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
                why = self._failure or f"said nothing that can be read for {timeout_s:g} s{self._refusals}"
                hint = self._hint or "Is it switched on, and is this the right port and baud rate?"
                raise DeviceError(f"{self._device}: {why}. {hint}")

    def read(self) -> Report:
        """The newest report, if it is recent.

        Raises:
            DeviceError: The device is gone.
        """
        with self._changed:
            newest, age_ns, failure = self._newest, time.monotonic_ns() - self._came_ns, self._failure
            refusals = self._refusals
        if failure:
            raise DeviceError(f"{self._device}: {failure}")
        if newest is None or age_ns > self._silent_ns:
            raise DeviceError(
                f"{self._device}: no report for {age_ns / 1e6:.0f} ms (limit {self._silent_ns / 1e6:.0f} ms)"
                f"{refusals}. {self._hint or 'Is the cable in, and the device on?'}"
            )
        return newest

    @property
    def _refusals(self) -> str:
        """How many reports were refused since the last good one, and why; to be read with the lock held."""
        return f"; {self._refused} refused, the last: {self._refusal}" if self._refused else ""


FORGET = 512  # reports after which the least delay is looked for anew, so that a drifting clock is followed


class DeviceTime:
    """Maps a device's clock to the host's by the report that came with the least delay.

    The error is that least delay itself: the time of the bytes on the wire, which no clock of one side can measure.
    """

    def __init__(self, wrap_ms: int = 0) -> None:
        """Begin anew.

        Args:
            wrap_ms: The device's counter begins again after so much; 0: never [ms].
        """
        self._wrap, self._last, self._turns = wrap_ms, 0.0, 0
        self._least: float | None = None
        self._next: float | None = None
        self._reports = 0

    def stamp_ns(self, device_ms: float, now_ns: int) -> int:
        """When a report was measured.

        Args:
            device_ms: Its time by the device's clock [ms].
            now_ns: The host's clock when it came, since the epoch [ns].

        Returns:
            Since the epoch, never after `now_ns` [ns].
        """
        if self._wrap and device_ms < self._last - self._wrap / 2:
            self._turns += 1
        elif device_ms < self._last - 1.0 and not self._wrap:  # the device was restarted
            self._least = self._next = None
        self._last = device_ms
        measured_ns = (device_ms + self._turns * self._wrap) * 1e6
        delay = now_ns - measured_ns
        if self._least is None or delay < self._least or abs(delay - self._least) > 1e9:
            self._least = delay
        self._next = delay if self._next is None else min(self._next, delay)
        self._reports += 1
        if self._reports % FORGET == 0:
            self._least, self._next = self._next, None
        return min(now_ns, round(measured_ns + self._least))
