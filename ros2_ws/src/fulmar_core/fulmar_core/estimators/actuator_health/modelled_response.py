"""What the actuators of one robot would do now if they were sound: delay, slew and lag of its file."""

from __future__ import annotations

import numpy as np

from fulmar_core.dynamics.by_kind import actuation_of
from fulmar_core.dynamics.linear_model import nominal_worlds
from fulmar_core.robots.robot import Robot


class ModelledResponse:
    """Follows the commands that were applied, by the model that simulators use."""

    def __init__(self, robot: Robot) -> None:
        """Begin in the safe state."""
        self._robot, self._world = robot, nominal_worlds(robot, 1)
        self._latest_s = robot.actuators.response.latest_s
        self.reset()

    def reset(self) -> None:
        """Begin anew in the safe state."""
        safe = np.asarray(self._robot.actuators.safe_command, dtype=float)[:, None]
        dt = self._robot.timing.physics_dt
        self._actuation = actuation_of(
            self._robot, safe, opens_late=False, latest_s=self._latest_s, step_s=dt
        )
        self._command: np.ndarray | None = None
        self._rest_s = 0.0

    def hold(self, command: np.ndarray) -> None:
        """Let every actuator stand where a command asks for, shape (n,)."""
        self._actuation.hold(np.asarray(command, dtype=float)[:, None])

    def follow(self, command: np.ndarray, seconds: float) -> np.ndarray:
        """Let a command act for some time.

        Args:
            command: That was applied, shape (n,).
            seconds: For how long; parts of a physics step are kept for the next call [s].

        Returns:
            What each actuator does after each physics step, shape (k, n); k may be 0.
        """
        dt = self._robot.timing.physics_dt
        if self._command is None or not np.array_equal(command, self._command):
            self._actuation.begin(np.asarray(command, dtype=float)[:, None], self._world, None)
            self._command = np.array(command, dtype=float)
        ticks = int((self._rest_s + seconds) / dt + 1e-6)
        self._rest_s = max(0.0, self._rest_s + seconds - ticks * dt)
        done = np.empty((ticks, len(command)))
        for tick in range(ticks):
            self._actuation.advance(dt, latest_s=self._latest_s)
            done[tick] = self._actuation.applied[:, 0]
        return done
