"""A user's own controller, loaded by its dotted path: `mypackage.mymodule:MyController`.

It is made as `MyController(robot, task, settings)`, and has `reset()` and `act(inputs)` as of
`fulmar_core.controllers.controller.Controller`. Its settings are the mapping in the YAML file of the same name beside
its module (`mymodule.yaml`), empty without such a file.
"""

from __future__ import annotations

import hashlib
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.errors import ConfigError
from fulmar_core.health.suspicion import Suspicion
from fulmar_core.own_class import SEPARATOR, construct, load_class
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task
from fulmar_core.yaml_text import YamlError, load

MEMBERS = ("reset", "act")


def is_own(name: str) -> bool:
    """Whether a controller's name is the dotted path of a class."""
    return SEPARATOR in name


class OwnController:
    """A user's class behind the interface of controllers.

    Attributes:
        estimator: The user's own `estimator`, where the class has one; see `Controller`.
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
        robot.timing.substeps(control_hz)  # refuses rates that the physics cannot keep
        cls = load_class(path, members=MEMBERS, what="controller")
        self._source = Path(str(sys.modules[cls.__module__].__file__))
        self._settings = _settings(self._source.with_suffix(".yaml"))
        self._own = construct(
            cls, "MyController(robot, task, settings)", "controller", robot, task, self._settings
        )
        self._pair = robot.name, task.name
        estimator = getattr(self._own, "estimator", None)
        if estimator is not None and not isinstance(estimator, Suspicion):
            raise ConfigError(
                f"controller '{path}': 'estimator' is a {type(estimator).__name__}, it must be a Suspicion or None."
            )
        self.estimator: Suspicion | None = estimator

    def reset(self) -> None:
        """Let it forget the past."""
        self._own.reset()

    def act(self, inputs: Inputs) -> np.ndarray:
        """Let it choose a command; see `Controller.act`."""
        return np.asarray(self._own.act(inputs), dtype=float)

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


def _settings(path: Path) -> dict[str, Any]:
    if not path.exists():
        return {}
    try:
        values = load(path.read_text(encoding="utf-8"))
    except YamlError as error:
        raise ConfigError(f"{path}:{error.line}: {error}.") from error
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}.") from error
    if not isinstance(values, dict):
        raise ConfigError(f"{path}: must hold a mapping, found {type(values).__name__}.")
    return values
