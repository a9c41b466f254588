"""Drivers of devices behind another stack's ROS node: they publish commands, and measure nothing."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fulmar_core.config.errors import DeviceError
from hardware_drivers.driver import DeviceDriver
from hardware_drivers.driver_backend import STOP_PERIOD_S, STOPS

Send = Callable[[np.ndarray], None]
LOOK_S = 0.05  # between two looks for a subscriber


LONELY_S = 0.5  # our value: a node that is started again is back later than this


@dataclass(frozen=True)
class Listeners:
    """Who takes the commands of a topic."""

    topic: str
    count: Callable[[], int]  # of its subscribers

    def wait(self, patience_s: float) -> None:
        """Wait for the first.

        Raises:
            DeviceError: None came in time [s].
        """
        until = time.monotonic() + patience_s
        while not self.count():
            if time.monotonic() > until:
                raise DeviceError(
                    f"no node subscribes to {self.topic}: nobody would carry out a command. Start the node of the "
                    "device, or name its topic with `topic:` in the hardware file."
                )
            time.sleep(LOOK_S)


class TopicDriver(DeviceDriver):
    """Publishes every command; our watchdog thereby also stops nodes that have none."""

    def __init__(self, send: Send, listeners: Listeners, *, patience_s: float) -> None:
        """Wait for a node that takes the commands.

        Args:
            send: Publishes a command.
            listeners: Of its topic.
            patience_s: As in `DeviceDriver`.

        Raises:
            DeviceError: There is none.
        """
        self._send, self._listeners = send, listeners
        self._listened_s = time.monotonic()
        listeners.wait(patience_s)

    def write(self, command: np.ndarray) -> None:
        """Send a command; see `DeviceDriver`."""
        self._send(command)

    def refusal(self) -> str:
        """Whether nobody takes the commands any more; see `Answering`."""
        now_s = time.monotonic()
        if self._listeners.count():
            self._listened_s = now_s
        if now_s - self._listened_s < LONELY_S:
            return ""
        return f"no node subscribes to {self._listeners.topic} any more: nobody carries out commands"

    def close(self) -> None:
        """Nothing is held; see `DeviceDriver`."""


class ValveTopicDriver(TopicDriver):
    """With an air bearing, which is in the same message as the valves."""

    def __init__(
        self,
        send: Callable[[np.ndarray, bool], None],
        listeners: Listeners,
        *,
        count: int,
        bearing_on: bool,
        linger_s: float,
        patience_s: float,
    ) -> None:
        """Prepare, and wait for a node that takes the commands.

        Args:
            send: Publishes zeros and ones, and whether the bearing shall be on.
            listeners: Of its topic.
            count: Number of valves.
            bearing_on: Whether it is, from the start on.
            linger_s: The bearing stays on so long after the last command [s].
            patience_s: As in `DeviceDriver`.

        Raises:
            DeviceError: There is none.
        """
        self._bearing, self._linger_s, self._count = bearing_on, linger_s, count
        super().__init__(lambda command: send(command, self._bearing), listeners, patience_s=patience_s)

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
