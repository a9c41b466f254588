"""A device that somebody else's ROS node drives: commands go out as messages, nothing comes back."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fulmar_core.backend import Sample
from fulmar_core.episode import Episode
from fulmar_core.robot import Robot

Send = Callable[[np.ndarray], None]
STOPS = 5


class TopicDriver:
    """Hands every command on; the watchdog before it then stops also nodes that have none."""

    def __init__(self, robot: Robot, send: Send) -> None:
        """Prepare.

        Args:
            robot: The robot.
            send: Publishes a command within the actuators' limits.
        """
        self.robot, self._send = robot, send

    def reset(self, episode: Episode, *, seed: int, number: int = 0) -> Sample:
        """Begin with the safe command; see `Backend.reset`."""
        return self.step(self.robot.actuators.safe_command)

    def step(self, command: np.ndarray, ticks: int = 1) -> Sample:
        """Send a command; see `Backend.step`."""
        self._send(np.asarray(command, dtype=float))
        return Sample(None, None, None)

    def make_safe(self) -> None:
        """Send the safe command, several times."""
        for _ in range(STOPS):
            self._send(self.robot.actuators.safe_command)

    def close(self) -> None:
        """As `make_safe`."""
        self.make_safe()

    def health(self) -> dict[str, str]:
        """Nothing is known; see `Device.health`."""
        return {}


class ValveTopicDriver(TopicDriver):
    """The same with an air bearing, which travels in the same message as the valves."""

    def __init__(self, robot: Robot, send: Callable[[np.ndarray, bool], None], *, bearing_on: bool) -> None:
        """Prepare; the bearing as `bearing_on` says, from the start on."""
        super().__init__(robot, lambda command: send(command, self._bearing))
        self._bearing = bearing_on

    def step(self, command: np.ndarray, ticks: int = 1) -> Sample:
        """Send a command, or closed valves while the bearing is off; see `Backend.step`."""
        applied = np.asarray(command, dtype=float) if self._bearing else self.robot.actuators.safe_command
        super().step(applied)
        return Sample(None, None, None, applied=applied)

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
