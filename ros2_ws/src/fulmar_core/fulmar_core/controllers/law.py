"""Base class of the classical laws: gains, rate, and an identity."""

from __future__ import annotations

import hashlib
import json
from abc import ABC, abstractmethod
from dataclasses import asdict
from typing import Any, ClassVar

import numpy as np

from fulmar_core.controllers.controller import Inputs, StateObserver
from fulmar_core.estimators.actuator_health.filters import HealthSettings
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task
from fulmar_core.tasks.observation import Observer


class Law(ABC):
    """A controller whose commands follow from a few gains.

    Attributes:
        estimator: See `Controller`.
        readings: See `Controller`.
        observer: See `Controller`.
        seeds: Of the noise of a law that draws any, in turns among craft side by side.
    """

    law: ClassVar[str]  # the end of its gains' file name
    title: ClassVar[str]  # for lists

    seeds: tuple[int, ...] = ()
    readings: tuple[str, ...] = ()
    observer: StateObserver[Any] | None = None

    def __init__(
        self,
        robot: Robot,
        task: Task,
        gains: Any,
        *,
        control_hz: float | None = None,
        name: str | None = None,
    ) -> None:
        """Bind a law to a robot and a task.

        Args:
            robot: The robot.
            task: The task.
            gains: A dataclass of numbers.
            control_hz: Command rate; the robot's own by default [Hz].
            name: Under which it was chosen; the law's own by default.
        """
        self.name = name or self.law
        self.control_hz = control_hz or robot.timing.control_hz
        self.robot, self.task, self.gains = robot, task, gains
        self.estimator: HealthSettings | None = None
        self.bind()
        robot.timing.substeps(self.control_hz)  # refuses rates that the physics cannot keep
        self.reset()
        self.prepare()

    @abstractmethod
    def bind(self) -> None:
        """Choose the frame that robot and task are seen in; raises ValueError for gains that the task asks more of."""

    def prepare(self) -> None:  # noqa: B027 - most laws need no more than their gains
        """Compute once what the commands need; raises ValueError for a robot that the law is not for."""

    def reset(self) -> None:  # noqa: B027 - most laws remember nothing
        """Forget what was seen."""

    def act(self, inputs: Inputs) -> np.ndarray:
        """Choose a command; shapes as in `Controller.act`."""
        return np.asarray(self.robot.actuators.limited(self.command(inputs)))

    @abstractmethod
    def command(self, inputs: Inputs) -> np.ndarray:
        """The law itself, before the actuators' limits; shapes as in `Controller.act`."""

    def metadata(self) -> dict[str, Any]:
        """Robot, task, rate and gains, with the SHA-256 of everything that the commands depend on."""
        identity = {
            "controller": self.name,
            "law": self.law,
            "robot": self.robot.name,
            "task": self.task.name,
            "control_hz": self.control_hz,
            "gains": asdict(self.gains),
        }
        text = json.dumps(identity | self.derived(), sort_keys=True)
        return identity | {"sha256": hashlib.sha256(text.encode()).hexdigest()}

    def derived(self) -> dict[str, Any]:
        """What else the commands depend on, as JSON-ready values."""
        water = self.robot.hydrodynamics
        return {
            "observation_names": Observer(self.robot, self.task).names,
            "actuators": asdict(self.robot.actuators),
            "body": asdict(self.robot.body),
            "performance": asdict(self.robot.performance),
            "hydrodynamics": asdict(water) if water else None,
        }
