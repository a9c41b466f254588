"""Whether a controller mostly asks for more than the actuators can do, which the limits cut without a word."""

from __future__ import annotations

import numpy as np

from fulmar_core.robots.actuators.family import Actuators

MOST = 0.5  # share of the steps beyond which it is worth a word [-]
LEAST_STEPS = 20  # fewer steps say nothing about most of them
SLACK = 1e-6  # of a limit, left to rounding [-]


class CommandRange:
    """Counts the steps of a controller in which an action lies beyond the limits of the actuators."""

    def __init__(self, actuators: Actuators) -> None:
        """Begin with no step."""
        self._actuators, slack = actuators, SLACK * actuators.scale
        self._low, self._high = actuators.lowest - slack, actuators.scale + slack
        self.steps = self.beyond = 0
        self._farthest, self._worst = 0.0, ""

    def see(self, actions: np.ndarray) -> None:
        """Count actions, shape (n, m); those of another shape, and rows that are not finite, are refused elsewhere."""
        if actions.ndim != 2 or actions.shape[1:] != self._low.shape:
            return
        actions = actions[np.isfinite(actions).all(axis=1)]
        over = np.maximum(actions - self._high, self._low - actions) / self._actuators.scale
        self.steps += len(actions)
        self.beyond += int(np.count_nonzero((over > 0.0).any(axis=1)))
        if over.size and over.max() > self._farthest:
            step, number = np.unravel_index(int(np.argmax(over)), over.shape)
            self._farthest, value = float(over.max()), float(actions[step, number])
            limit = self._actuators.scale if value > 0.0 else self._actuators.lowest
            name, unit = self._actuators.names[number], self._actuators.units[number]
            self._worst = f"{name} {value:.4g} {unit}, where the limit is {limit[number]:.4g}"

    @property
    def warning(self) -> str:
        """That most steps were beyond the limits, with the share and the unit; empty where they were not."""
        if self.steps < LEAST_STEPS or self.beyond <= MOST * self.steps:
            return ""
        return (
            f"the controller asked for more than the actuators can do in {100.0 * self.beyond / self.steps:.0f} % of "
            f"{self.steps} steps, at most {self._worst}: commands are cut there"
        )
