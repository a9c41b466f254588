"""Controllers of boats and wheels with a defect: what the envelope guard has to keep in an area."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fulmar_benchmarks.guard.defects import (
    ADVERSARY,
    DRIFT,
    HIDDEN,
    NONE,
    OPEN_SHARE,
    SIGN,
    STUCK,
    UNTRAINED,
    WithDefect,
)
from fulmar_core.controllers.controller import Controller, Inputs
from fulmar_core.robots.robot import Robot
from fulmar_core.states.planar import wrapped
from fulmar_core.tasks import Task
from fulmar_core.tasks.observation import Observer


class DefectiveDriver(WithDefect):
    """A controller of n boats, or of robots on wheels, with one defect; see `defects.Defective`.

    `adversary` drives away from the area's middle at full speed, by the end that points outwards; `drift` does so in
    one direction of the world in half of its steps.

    Attributes:
        name: The defect.
        control_hz: See `Controller`.
        estimator: See `Controller`.
        observer: See `Controller`.
        readings: See `Controller`.
    """

    def __init__(
        self, defect: str, sound: Controller, robot: Robot, task: Task, *, count: int, seed: int
    ) -> None:
        """Draw what is drawn; arguments as in `defects.Defective`."""
        super().__init__(defect, sound)
        self._actuators, self._observer = robot.actuators, Observer(robot, task.fitted(robot))
        # What each actuator does for full speed ahead, and for a full turn to the left, as shares of its command.
        full = [robot.actuators.by_hand(*axis) for axis in ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))]
        self._mixed = np.array(full, dtype=float) / robot.actuators.scale
        self._random = random = np.random.default_rng(seed)
        self._stuck = random.integers(0, len(robot.actuators.names), count)
        self._way = random.uniform(-np.pi, np.pi, count)
        inputs, outputs = len(self._observer.names), len(robot.actuators.names)
        self._first = random.normal(size=(count, inputs, HIDDEN)) / np.sqrt(inputs)
        self._second = random.normal(size=(count, HIDDEN, outputs)) / np.sqrt(HIDDEN)
        acts: dict[str, Callable[[Inputs], np.ndarray]] = {
            NONE: sound.act, ADVERSARY: self._away, DRIFT: self._drift, SIGN: self._mirrored,
            STUCK: self._with_stuck, UNTRAINED: self._random_network,
        }  # fmt: skip
        self._act = acts[defect]

    def _along(self, inputs: Inputs, bearing: np.ndarray) -> np.ndarray:
        """Full speed towards a bearing in the world, by the end that is nearer to it."""
        off = wrapped(bearing - inputs.state.yaw)
        ahead = np.where(np.cos(off) >= 0.0, 1.0, -1.0)
        turn = np.clip(2.0 * np.sin(off) * ahead, -1.0, 1.0)
        return np.asarray((np.stack((ahead, turn), axis=-1) @ self._mixed) * self._actuators.scale)

    def _away(self, inputs: Inputs) -> np.ndarray:
        return self._along(inputs, np.arctan2(inputs.state.y, inputs.state.x))

    def _drift(self, inputs: Inputs) -> np.ndarray:
        goes = self._random.random((len(self._way), 1)) < OPEN_SHARE
        return self._along(inputs, self._way) * goes

    def _mirrored(self, inputs: Inputs) -> np.ndarray:
        targets = np.array(inputs.goal.targets)
        place = np.stack((inputs.state.x, inputs.state.y), axis=-1)
        targets[:, :, :2] = 2.0 * place[:, None] - targets[:, :, :2]
        goal = replace(inputs.goal, targets=targets)
        seen = np.asarray(self._observer(inputs.state, goal, inputs.previous, None), dtype=float)
        return self._sound.act(replace(inputs, goal=goal, observation=seen))

    def _with_stuck(self, inputs: Inputs) -> np.ndarray:
        command = np.array(self._sound.act(inputs))
        command[np.arange(len(command)), self._stuck] = self._actuators.scale[self._stuck]
        return command

    def _random_network(self, inputs: Inputs) -> np.ndarray:
        hidden = np.tanh(np.einsum("ni,nij->nj", inputs.observation, self._first))
        return np.asarray(
            np.tanh(3.0 * np.einsum("ni,nij->nj", hidden, self._second)) * self._actuators.scale
        )
