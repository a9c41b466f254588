"""Controllers of aircraft with a defect: what the envelope guard has to keep above the water."""

from __future__ import annotations

from collections.abc import Callable

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
from fulmar_core.dynamics.by_kind import begin_of
from fulmar_core.dynamics.flight_schedule import MOTION, RATE, flight_models
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task
from fulmar_core.tasks.observation import Observer

PITCH_RATE = RATE.start + 1  # nose down counted positive


class DefectivePilot(WithDefect):
    """A controller of n craft with one defect; see `defects.Defective`.

    `adversary` puts the nose down with all that its elevator has, `drift` banks to one side in half of its steps,
    `sign` answers departures from level flight the wrong way round, and of `stuck` one actuator always gets full
    command, to a drawn side.

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
        self._robot = robot
        names = robot.actuators.names
        self._elevator, self._aileron = names.index("elevator"), names.index("aileron")
        model = flight_models(robot, robot.wings.speed, 1.0 / sound.control_hz)[0]
        self._down = float(np.sign(model.a[PITCH_RATE, MOTION + self._elevator]))
        random = self._random = np.random.default_rng(seed)
        self._low, self._high = robot.actuators.lowest, robot.actuators.scale
        self._side = random.choice((-1.0, 1.0), count)
        self._stuck = random.integers(0, len(names), count)
        inputs = len(Observer(robot, task.fitted(robot)).names)
        self._first = random.normal(size=(count, inputs, HIDDEN)) / np.sqrt(inputs)
        self._second = random.normal(size=(count, HIDDEN, len(names))) / np.sqrt(HIDDEN)
        acts: dict[str, Callable[[Inputs], np.ndarray]] = {
            NONE: sound.act, ADVERSARY: self._dives, DRIFT: self._banks, SIGN: self._reversed,
            STUCK: self._with_stuck, UNTRAINED: self._random_network,
        }  # fmt: skip
        self._act = acts[defect]

    def _level(self, inputs: Inputs) -> np.ndarray:
        return np.array(begin_of(self._robot).command(self._robot, inputs.state))

    def _dives(self, inputs: Inputs) -> np.ndarray:
        command = self._level(inputs)
        command[:, self._elevator] = self._down * self._high[self._elevator]
        return command

    def _banks(self, inputs: Inputs) -> np.ndarray:
        command = np.array(self._sound.act(inputs))
        banks = self._random.random(len(command)) < OPEN_SHARE
        full = self._side * self._high[self._aileron]
        command[:, self._aileron] = np.where(banks, full, command[:, self._aileron])
        return command

    def _reversed(self, inputs: Inputs) -> np.ndarray:
        return 2.0 * self._level(inputs) - self._sound.act(inputs)

    def _with_stuck(self, inputs: Inputs) -> np.ndarray:
        command = np.array(self._sound.act(inputs))
        each, which = np.arange(len(command)), self._stuck
        command[each, which] = np.where(self._side > 0.0, self._high[which], self._low[which])
        return command

    def _random_network(self, inputs: Inputs) -> np.ndarray:
        hidden = np.tanh(np.einsum("ni,nij->nj", inputs.observation, self._first))
        share = 0.5 + 0.5 * np.tanh(np.einsum("ni,nij->nj", hidden, self._second))
        return np.asarray(self._low + share * (self._high - self._low))
