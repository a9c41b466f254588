"""Whether a robot can hold a pose at all without the actuators that are believed dead."""

from __future__ import annotations

import threading

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.worlds.holdability import LEAST_MARGIN, can_hold
from fulmar_core.worlds.spatial_holdability import hold_margin_in_space

SURE_S = 2.0  # an actuator is believed dead for so long before a robot is given up for it [s]


def can_hold_without(robot: Robot, lost: tuple[int, ...]) -> bool:
    """Whether a pose can be held without some actuators of a robot with valves or fans, their numbers from 0."""
    if robot.body.planar:
        return can_hold(robot, lost)
    working = np.ones(len(robot.actuators.names))
    working[list(lost)] = 0.0
    nothing = np.zeros(3)
    return hold_margin_in_space(robot, working, nothing, nothing, np.array(robot.body.com)) > LEAST_MARGIN


class Losses:
    """Finds out beside the control loop, which the first answer would hold up for half a second."""

    def __init__(self, robot: Robot, *, waits: bool = False) -> None:
        """Prepare for a robot with valves or fans; in lock step the loop waits for the answer."""
        self._robot, self._waits = robot, waits
        self._numbers = {name: number for number, name in enumerate(robot.actuators.names)}
        self._holds: dict[tuple[str, ...], bool] = {}  # without these actuators
        self._asked: set[tuple[str, ...]] = set()
        self._dead: tuple[str, ...] = ()
        self._since_ns = 0

    def hopeless(self, dead: tuple[str, ...], stamp_ns: int) -> bool:
        """Whether no pose can be held without what has been dead for long enough, as far as that is known by now.

        Args:
            dead: Names of the actuators that are believed dead now.
            stamp_ns: Time, on any clock that goes forward [ns].
        """
        if dead != self._dead or stamp_ns < self._since_ns:
            self._dead, self._since_ns = dead, stamp_ns
        if not dead:
            return False
        if dead not in self._asked:
            self._asked.add(dead)
            thread = threading.Thread(target=self._find, args=(dead,), name="losses", daemon=True)
            thread.start()
            if self._waits:
                thread.join()
        sure = stamp_ns - self._since_ns >= 1e9 * SURE_S
        return sure and not self._holds.get(dead, True)

    def _find(self, dead: tuple[str, ...]) -> None:
        self._holds[dead] = can_hold_without(self._robot, tuple(self._numbers[name] for name in dead))
