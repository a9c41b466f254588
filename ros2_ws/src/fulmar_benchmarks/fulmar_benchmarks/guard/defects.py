"""Controllers with a defect: what the envelope guard has to keep in an area."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from fulmar_core.controllers.controller import Controller, Inputs
from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.robots.robot import Robot
from fulmar_core.states.rotation import rotate_inverse
from fulmar_core.tasks import Task
from fulmar_core.tasks.observation import Observer

NONE, ADVERSARY, DRIFT, SIGN, STUCK, UNTRAINED = DEFECTS = (
    "none", "adversary", "drift", "sign", "stuck", "untrained",
)  # fmt: skip
HIDDEN = 32  # units of an untrained network
OPEN_SHARE = 0.5  # of the steps in which a drifting controller pushes


class WithDefect:
    """What every defective controller is beside its defect: a `Controller` that asks a sound one, or acts itself."""

    _act: Callable[[Inputs], np.ndarray]  # by the defect

    def __init__(self, defect: str, sound: Controller) -> None:
        """Take a defect's name, and the controller that has it."""
        self.name, self._sound = defect, sound
        self.control_hz, self.readings = sound.control_hz, sound.readings
        self.estimator, self.observer = sound.estimator, sound.observer

    def reset(self) -> None:
        """Forget the past."""
        self._sound.reset()

    def act(self, inputs: Inputs) -> np.ndarray:
        """Choose commands, shape (n, m)."""
        return self._act(inputs)

    def metadata(self) -> dict[str, Any]:
        """The defect."""
        return {"controller": self.name}


class Defective(WithDefect):
    """A controller of n robots with one defect, each robot with its own draw of it.

    `adversary` drives away from the area's middle with all it has, `drift` in one direction of the world in half of its
    steps, `sign` answers the goal mirrored at the robot, of `stuck` one actuator always gets full command, `untrained`
    is a network with random weights.

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
        """Draw what is drawn.

        Args:
            defect: One of `DEFECTS`.
            sound: The controller that has the defect.
            robot: The robot.
            task: The task.
            count: n.
            seed: Of the draws.
        """
        super().__init__(defect, sound)
        self._task, self._observer = task, Observer(robot, task.fitted(robot))
        self._actuators, self._axes = robot.actuated_by(Pushing), robot.state_type.AXES
        self._random = random = np.random.default_rng(seed)
        actuators = len(robot.actuators.names)
        self._stuck = random.integers(0, actuators, count)
        ways = random.normal(size=(count, 3))
        ways[:, self._axes :] = 0.0
        self._way = ways / np.linalg.norm(ways, axis=1, keepdims=True)
        inputs = len(self._observer.names)
        self._first = random.normal(size=(count, inputs, HIDDEN)) / np.sqrt(inputs)
        self._second = random.normal(size=(count, HIDDEN, actuators)) / np.sqrt(HIDDEN)
        acts: dict[str, Callable[[Inputs], np.ndarray]] = {
            NONE: sound.act, ADVERSARY: self._away, DRIFT: self._drift, SIGN: self._mirrored,
            STUCK: self._with_stuck, UNTRAINED: self._random_network,
        }  # fmt: skip
        self._act = acts[defect]

    def _push(self, inputs: Inputs, way: np.ndarray) -> np.ndarray:
        """The actuators that push most along a way in the world, shape (n, 3), with full command."""
        quat = inputs.state.to_rigid().quat_xyzw
        along = rotate_inverse(quat, way) @ self._actuators.wrench_per_newton[:, :3].T
        if self._actuators.shared_pressure:
            return np.asarray(np.eye(along.shape[1])[along.argmax(axis=1)])
        return np.asarray((along > 0.0).astype(float))

    def _away(self, inputs: Inputs) -> np.ndarray:
        return self._push(inputs, inputs.state.to_rigid().position_in_world + 1e-6)

    def _drift(self, inputs: Inputs) -> np.ndarray:
        opened = self._random.random((len(self._way), 1)) < OPEN_SHARE
        return self._push(inputs, self._way) * opened

    def _mirrored(self, inputs: Inputs) -> np.ndarray:
        targets, axes = np.array(inputs.goal.targets), self._axes
        place = inputs.state.to_rigid().position_in_world[:, :axes]
        targets[:, :, :axes] = 2.0 * place[:, None] - targets[:, :, :axes]
        goal = replace(inputs.goal, targets=targets)
        seen = np.asarray(self._observer(inputs.state, goal, inputs.previous, None), dtype=float)
        return self._sound.act(replace(inputs, goal=goal, observation=seen))

    def _with_stuck(self, inputs: Inputs) -> np.ndarray:
        command = np.array(self._sound.act(inputs))
        command[np.arange(len(command)), self._stuck] = self._actuators.scale[self._stuck]
        return command

    def _random_network(self, inputs: Inputs) -> np.ndarray:
        hidden = np.tanh(np.einsum("ni,nij->nj", inputs.observation, self._first))
        return (np.einsum("ni,nij->nj", hidden, self._second) > 0.0).astype(float)
