"""Where servos and motors of aircraft are, which nothing measures: by the commands that were sent."""

from __future__ import annotations

import numpy as np

from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces


class FlightServos:
    """Servos and motors of n craft in linear motion, without limits.

    Attributes:
        now: Deflections and thrust levels, then rates of the servos, shape (n, k); None: nothing was sent yet.
    """

    def __init__(self, craft: ControlSurfaces, dt: float) -> None:
        """Prepare; `dt` of a control step [s]."""
        self._surfaces, self._motors = craft.positions, len(craft.motors)
        self._matrix = craft.servo_matrix(dt)
        self._keep = np.array([np.exp(-dt / motor.lag_s) if motor.lag_s else 0.0 for motor in craft.motors])
        self.reset()

    def reset(self) -> None:
        """Forget the past."""
        self.now: np.ndarray | None = None

    def after(self, command: np.ndarray) -> np.ndarray:
        """Where they are a control step after a command (n, m); the first one, or one of other craft, is there."""
        if self.now is None or len(self.now) != len(command):
            still = np.zeros((len(command), self._surfaces))
            self.now = np.concatenate((command, still), axis=-1)
        else:
            self.now = self._followed(self.now, command)
        return self.now

    def departures(self, now: np.ndarray, level: np.ndarray) -> np.ndarray:
        """Departures of deflections, their rates, and levels from a command (n, m), shape (n, k); `now` as above."""
        ends = self._surfaces + self._motors
        places = now[:, : self._surfaces] - level[:, : self._surfaces]
        levels = now[:, self._surfaces : ends] - level[:, self._surfaces :]
        return np.concatenate((places, now[:, ends:], levels), axis=-1)

    def _followed(self, now: np.ndarray, command: np.ndarray) -> np.ndarray:
        surfaces, ends, matrix = self._surfaces, self._surfaces + self._motors, self._matrix
        off, rates = now[:, :surfaces] - command[:, :surfaces], now[:, ends:]
        places = command[:, :surfaces] + matrix[0, 0] * off + matrix[0, 1] * rates
        levels = command[:, surfaces:] + self._keep * (now[:, surfaces:ends] - command[:, surfaces:])
        return np.concatenate((places, levels, matrix[1, 0] * off + matrix[1, 1] * rates), axis=-1)
