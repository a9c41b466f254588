"""Where boats are by what they must have done since they were last seen, and a little by what is read now.

A Luenberger observer with one gain: readings err anew each time, the core's own boat in still water hardly does.
"""

from __future__ import annotations

import numpy as np

from fulmar_core.robot import Robot
from fulmar_core.tasks import Task
from policy_server.planning.boat import MOTION
from policy_server.planning.rehearsal import Nominal


class Estimator:
    """What is believed of some boats."""

    def __init__(
        self, robot: Robot, task: Task, *, rows: int, control_hz: float, trust: float, carried: float
    ) -> None:
        """Nothing is known yet.

        Args:
            robot: The boat.
            task: What it is about.
            rows: How many boats.
            control_hz: How often they are seen.
            trust: Share of what a reading differs by from what is expected that is believed [-].
            carried: How far from where it is expected a boat is read if it was carried there: all of that is believed
                then [m].
        """
        self._boats = Nominal(robot, task, rows=rows, control_hz=control_hz)
        self._trust, self._carried = trust, carried
        self._seen = np.zeros(rows)  # readings since nothing was known
        self._states: np.ndarray | None = None

    def see(self, readings: np.ndarray) -> np.ndarray:
        """Take readings of the states, shape (rows, size), and say what the states are."""
        if self._states is None:
            self._states = readings
        self._boats.put(self._states)
        self._boats.step(readings[:, MOTION:])
        expected = self._boats.states
        carried_off = np.hypot(*(readings - expected)[:, :2].T) > self._carried
        self._seen = np.where(carried_off, 1.0, self._seen + 1.0)
        trust = np.maximum(self._trust, 1.0 / self._seen)  # a first reading is no better than the next ones
        believed = expected + trust[:, None] * (readings - expected)
        self._states = np.concatenate((believed[:, :MOTION], readings[:, MOTION:]), axis=1)
        return self._states
