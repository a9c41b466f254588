"""A user's own controller, loaded by its dotted path: `mypackage.mymodule:MyController`.

It is made as `MyController(robot, task, settings)`, and has `reset()` and `act(inputs)` as of
`fulmar_core.controllers.controller.Controller`. Its settings are the mapping in the YAML file of the same name beside
its module (`mymodule.yaml`), empty without such a file.
"""

from __future__ import annotations

import hashlib
import json
from typing import Any

import numpy as np

from fulmar_core.config.errors import ConfigError, did_you_mean
from fulmar_core.config.own_class import construct, load_class, settings_beside, source_of
from fulmar_core.controllers.controller import Inputs
from fulmar_core.estimators.actuator_health.filters import HealthSettings
from fulmar_core.estimators.readings import readings_of
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.command_range import CommandRange
from fulmar_core.tasks import Task

MEMBERS = ("reset", "act")


class OwnController:
    """A user's class behind the interface of controllers.

    Attributes:
        estimator: The user's own `estimator`, where the class has one; see `Controller`.
        readings: The user's own `readings`, where the class has them; see `Controller`.
        observer: The user's own `observer`, likewise.
        range: Counts the steps in which it asked for more than the actuators can do.
    """

    def __init__(self, path: str, robot: Robot, task: Task, control_hz: float) -> None:
        """Load the class and make one.

        Args:
            path: Dotted path of the class.
            robot: The robot.
            task: What it does.
            control_hz: How often it is asked [Hz].

        Raises:
            ConfigError: The class cannot be loaded, lacks a member, or its constructor raises.
        """
        self.name, self.control_hz = path, control_hz
        self.range = CommandRange(robot.actuators)
        robot.timing.substeps(control_hz)  # refuses rates that the physics cannot keep
        cls = load_class(path, members=MEMBERS, what="controller")
        self._source, self._settings = source_of(cls), settings_beside(cls)
        self._own = construct(
            cls, "MyController(robot, task, settings)", "controller", robot, task, self._settings
        )
        self._pair = robot.name, task.name
        estimator = getattr(self._own, "estimator", None)
        if estimator is not None and not isinstance(estimator, HealthSettings):
            raise ConfigError(
                f"controller '{path}': 'estimator' is a {type(estimator).__name__}, "
                "it must be a HealthSettings or None."
            )
        self.estimator: HealthSettings | None = estimator
        self.observer = getattr(self._own, "observer", None)
        self.readings = _readings(path, getattr(self._own, "readings", ()), robot)

    def reset(self) -> None:
        """Reset the user's controller; see `Controller.reset`."""
        self._own.reset()

    def act(self, inputs: Inputs) -> np.ndarray:
        """Command of the user's controller; see `Controller.act`."""
        action = np.asarray(self._own.act(inputs), dtype=float)
        self.range.see(action)
        return action

    def metadata(self) -> dict[str, Any]:
        """Class, robot, task, rate and settings, with the SHA-256 of these and of the module's source."""
        robot, task = self._pair
        said = {
            "controller": self.name,
            "robot": robot,
            "task": task,
            "control_hz": self.control_hz,
            "settings": self._settings,
        }
        text = json.dumps(said, sort_keys=True, default=str).encode() + self._source.read_bytes()
        return said | {"sha256": hashlib.sha256(text).hexdigest()}


def _readings(path: str, given: Any, robot: Robot) -> tuple[str, ...]:
    names, known = (given,) if isinstance(given, str) else tuple(given), readings_of(robot)
    for name in names:
        if name not in known:
            raise ConfigError(
                f"controller '{path}': 'readings' has '{name}'. Known: {', '.join(known)}."
                f"{did_you_mean(str(name), known)}"
            )
    return names
