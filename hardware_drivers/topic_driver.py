"""A device that somebody else's ROS node drives: commands go out as messages, nothing comes back."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from fulmar_core.actuators.slowdown import slowdown
from fulmar_core.backend import Sample
from fulmar_core.episode import Episode
from fulmar_core.robot import Robot

Send = Callable[[np.ndarray], None]
STOPS = 5
# Between them, and after the last: publishers keep one message, and the process may end right after it.
STOP_PERIOD_S = 0.02


class TopicDriver:
    """Hands every command on; the watchdog before it then stops also nodes that have none."""

    def __init__(self, robot: Robot, send: Send) -> None:
        """Prepare.

        Args:
            robot: The robot.
            send: Publishes a command within the actuators' limits.
        """
        self.robot, self._publish = robot, send
        self._sent = robot.actuators.safe_command

    def reset(self, episode: Episode, *, seed: int, number: int = 0) -> Sample:
        """Begin with the safe command; see `Backend.reset`."""
        return self.step(self.robot.actuators.safe_command)

    def step(self, command: np.ndarray, ticks: int = 1) -> Sample:
        """Send a command; see `Backend.step`."""
        self._send(np.asarray(command, dtype=float))
        return Sample(None, None, None)

    def make_safe(self) -> None:
        """Let wheels slow down, and send the safe command several times, with time for each to arrive."""
        ramp = slowdown(self.robot.actuators, self._sent, STOP_PERIOD_S)
        for command in (*ramp, *[self.robot.actuators.safe_command] * STOPS):
            self._send(command)
            time.sleep(STOP_PERIOD_S)

    def close(self) -> None:
        """As `make_safe`."""
        self.make_safe()

    def health(self) -> dict[str, str]:
        """Nothing is known; see `Device.health`."""
        return {}

    def _send(self, command: np.ndarray) -> None:
        self._publish(command)
        self._sent = command


class ValveTopicDriver(TopicDriver):
    """The same with an air bearing, which travels in the same message as the valves."""

    def __init__(
        self, robot: Robot, send: Callable[[np.ndarray, bool], None], *, bearing_on: bool, linger_s: float
    ) -> None:
        """Prepare.

        Args:
            robot: The robot.
            send: Publishes zeros and ones, and whether the bearing shall be on.
            bearing_on: Whether it is, from the start on.
            linger_s: It carries the platform so long after the last valve has closed for good [s].
        """
        super().__init__(robot, lambda command: send(command, self._bearing))
        self._bearing, self._linger_s = bearing_on, linger_s

    def step(self, command: np.ndarray, ticks: int = 1) -> Sample:
        """Send a command, or closed valves while the bearing is off; see `Backend.step`."""
        applied = np.asarray(command, dtype=float) if self._bearing else self.robot.actuators.safe_command
        super().step(applied)
        return Sample(None, None, None, applied=applied)

    def close(self) -> None:
        """Close every valve, and let the platform down after a while."""
        self.make_safe()
        if self._bearing:
            time.sleep(self._linger_s)
            self._bearing = False
            self.make_safe()

    @property
    def bearing_on(self) -> bool:
        """See `AirBearing`."""
        return self._bearing

    def set_bearing(self, on: bool) -> str:
        """See `AirBearing`."""
        self._bearing = on
        return ""

    def health(self) -> dict[str, str]:
        """Whether it floats; see `Device.health`."""
        return {
            "air_bearing": "on" if self._bearing else "off",
            "warning": "" if self._bearing else "the air bearing is off: the valves stay closed",
        }
