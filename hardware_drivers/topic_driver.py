"""Drivers of devices behind another stack's ROS node: they publish commands, and measure nothing."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from hardware_drivers.driver import DeviceDriver
from hardware_drivers.driver_backend import STOP_PERIOD_S, STOPS

Send = Callable[[np.ndarray], None]


class TopicDriver(DeviceDriver):
    """Publishes every command; our watchdog thereby also stops nodes that have none."""

    def __init__(self, send: Send) -> None:
        self._send = send

    def write(self, command: np.ndarray) -> None:
        """Send a command; see `DeviceDriver`."""
        self._send(command)

    def close(self) -> None:
        """Nothing is held; see `DeviceDriver`."""


class ValveTopicDriver(TopicDriver):
    """With an air bearing, which is in the same message as the valves."""

    def __init__(
        self, send: Callable[[np.ndarray, bool], None], *, count: int, bearing_on: bool, linger_s: float
    ) -> None:
        """Prepare.

        Args:
            send: Publishes zeros and ones, and whether the bearing shall be on.
            count: Number of valves.
            bearing_on: Whether it is, from the start on.
            linger_s: The bearing stays on so long after the last command [s].
        """
        super().__init__(lambda command: send(command, self._bearing))
        self._bearing, self._linger_s, self._count = bearing_on, linger_s, count

    def close(self) -> None:
        """Switch the bearing off after `linger_s`; see `DeviceDriver`."""
        if self._bearing:
            time.sleep(self._linger_s)
            self._bearing = False
            for _ in range(STOPS):
                self.write(np.zeros(self._count))
                time.sleep(STOP_PERIOD_S)

    @property
    def bearing_on(self) -> bool:
        """See `AirBearing`."""
        return self._bearing

    def set_bearing(self, on: bool) -> str:
        """See `AirBearing`."""
        self._bearing = on
        return ""

    def health(self) -> dict[str, str]:
        """Whether it floats; see `DeviceDriver`."""
        return {
            "air_bearing": "on" if self._bearing else "off",
            "warning": "" if self._bearing else "the air bearing is off: the valves stay closed",
        }
