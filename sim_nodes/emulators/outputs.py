"""Emulated devices without measurements: valves on GPIO pins, and nodes of other stacks that take commands."""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.backend import Sample


class ValveBank:
    """Valves and bearing on the pins of a GPIO chip that is a file; they keep their state when the driver dies."""

    def __init__(
        self,
        path: Path,
        robot: Robot,
        *,
        order: tuple[int, ...],
        active_low: bool,
        bearing: bool = True,
        supply: bool = False,
    ) -> None:
        """Make the chip, with all pins inactive.

        Args:
            path: The file to make.
            robot: The robot.
            order: Which thruster each pin opens, counted from 0; the bearing's pin comes after them.
            active_low: Whether a valve opens at level 0.
            bearing: Whether there is a bearing; a robot without one floats.
            supply: Whether a valve shuts off the supply of the others; its pin comes last.
        """
        self._path, self._order, self._open_level = path, np.array(order), int(not active_low)
        self._count, self._bearing, self._supply = len(robot.actuators.names), bearing, supply
        half_made = path.with_suffix(".new")
        half_made.write_bytes(bytes([1 - self._open_level]) * (self._count + bearing + supply))
        half_made.rename(path)  # a driver that waits for it finds all of its pins
        self._file = path.open("rb", buffering=0)
        self.address = f"file://{path}"

    def command(self, now_s: float) -> np.ndarray:
        """See `EmulatedDevice`; without air the platform stands on the floor, and without supply no valve blows."""
        levels = self.levels()
        valves = np.zeros(self._count)
        if (levels[self._count :] == self._open_level).all():
            valves[self._order] = levels[: self._count] == self._open_level
        return valves

    @property
    def air(self) -> bool:
        """Whether the valve of the bearing is open; there is one."""
        return bool(self.levels()[self._count] == self._open_level)

    def levels(self) -> np.ndarray:
        """Level at each valve's pin in the order of the wiring, then of bearing and supply, shape (n + 0 to 2,)."""
        self._file.seek(0)
        pins = self._count + self._bearing + self._supply
        return np.frombuffer(self._file.read(pins), dtype=np.uint8)

    def report(self, sample: Sample, now_s: float) -> None:
        """Valves report nothing."""

    def close(self) -> None:
        """See `EmulatedDevice`."""
        self._file.close()
        self._path.unlink(missing_ok=True)


BASE_TIMEOUT_S = 0.6  # kobuki_node: cmd_vel_timeout_sec
NO_TIMEOUT_S = math.inf  # neither the lab's valve node nor the public part of RoboRAN's bridge has a timeout


class TopicDevice:
    """Device behind a node of another stack: executes the newest message until its own timeout."""

    def __init__(self, address: str, count: int, *, timeout_s: float) -> None:
        """Begin at rest.

        Args:
            address: Topic that it takes commands from.
            count: Number of values of a command.
            timeout_s: It stops after so long without a message [s].
        """
        self.address, self._count, self._timeout_s = address, count, timeout_s
        self._lock = threading.Lock()
        self._values, self._came_s = np.zeros(count), -math.inf

    def receive(self, values: Sequence[float], now_s: float) -> None:
        """Take a message at this time of the monotonic clock [s]; one of another length is dropped."""
        if len(values) == self._count:
            with self._lock:
                self._values, self._came_s = np.array(values, dtype=float), now_s

    def command(self, now_s: float) -> np.ndarray:
        """See `EmulatedDevice`."""
        with self._lock:
            fresh = now_s - self._came_s <= self._timeout_s
            return self._values.copy() if fresh else np.zeros(self._count)

    def report(self, sample: Sample, now_s: float) -> None:
        """Topics of commands report nothing."""

    def close(self) -> None:
        """See `EmulatedDevice`."""


class ValveNode(TopicDevice):
    """The SnT valve node: the bearing first, then one value for each valve in the order of the wiring."""

    def __init__(self, address: str, order: Sequence[int], *, inverted: bool) -> None:
        """Begin with closed valves and without air.

        Args:
            address: Topic that it takes commands from.
            order: Which thruster each value opens, counted from 0.
            inverted: Whether a valve opens at 0; the bearing does not.
        """
        super().__init__(address, len(order) + 1, timeout_s=NO_TIMEOUT_S)
        self._order, self._open = list(order), float(not inverted)

    @property
    def air(self) -> bool:
        """Whether the valve of the bearing is open."""
        return bool(self._values[0] > 0.5)

    def command(self, now_s: float) -> np.ndarray:
        """See `EmulatedDevice`; without air the platform stands on the floor, and without supply no valve blows."""
        values = super().command(now_s)
        valves = np.zeros(len(self._order))
        if self.air:
            valves[self._order] = (values[1:] > 0.5) == (self._open > 0.5)
        return valves
