"""No controller: the safe command in each step, while a person drives, or until another controller is chosen."""

from __future__ import annotations

import hashlib
import json
from typing import Any

import numpy as np

from fulmar_core.controllers.controller import Inputs, StateObserver
from fulmar_core.estimators.actuator_health.filters import HealthSettings
from fulmar_core.robots.robot import Robot


class Rest:
    """Commands the actuators' safe state; see `Controller`."""

    title = "nothing: the actuators rest, and a person may drive"

    def __init__(self, robot: Robot, *, control_hz: float, name: str) -> None:
        """Prepare.

        Args:
            robot: The robot.
            control_hz: Command rate [Hz].
            name: Under which it was chosen.
        """
        robot.timing.substeps(control_hz)  # refuses rates that the physics cannot keep
        self.name, self.control_hz = name, control_hz
        self.estimator: HealthSettings | None = None
        self.readings: tuple[str, ...] = ()
        self.observer: StateObserver[Any] | None = None
        self._robot, self._safe = robot.name, np.asarray(robot.actuators.safe_command, dtype=float)

    def reset(self) -> None:
        """Nothing is remembered."""

    def act(self, inputs: Inputs) -> np.ndarray:
        """The safe command, for each robot; shapes as in `Controller.act`."""
        return np.tile(self._safe, (len(inputs.previous), 1))

    def metadata(self) -> dict[str, Any]:
        """Robot and rate; nothing else defines it."""
        identity = {"controller": self.name, "robot": self._robot, "control_hz": self.control_hz}
        text = json.dumps(identity | {"safe": self._safe.tolist()}, sort_keys=True)
        return identity | {"sha256": hashlib.sha256(text.encode()).hexdigest()}
