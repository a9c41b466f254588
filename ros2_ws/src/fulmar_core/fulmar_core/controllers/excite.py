"""Excitation for identification: random commands that keep the robot in its room.

A run that identifies a model needs every actuator at work, in changing company and for changing times; a controller
that reaches its goal and stops shows little. Random commands alone let a body without friction drift away. So several
random commands are drawn each time, the core predicts where each would lead, and the one that leads back best is taken:
few candidates near the goal, which leaves most of the randomness, more of them farther out.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from fulmar_core.controllers.body_frame import BodyFrame
from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.law import Law
from fulmar_core.dynamics.batch_dynamics import Steps
from fulmar_core.dynamics.by_kind import actuation_of, dynamics_of
from fulmar_core.dynamics.linear_model import calm, nominal_worlds
from fulmar_core.robots.actuators.excitation import Excitation
from fulmar_core.robots.actuators.families import FAMILIES
from fulmar_core.robots.robot import Robot
from fulmar_core.states.attitude import length, minus, plus, scaled
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.spatial import SpatialState, position_of
from fulmar_core.states.state import State
from fulmar_core.tasks import Task

SEED = 5  # of the commands: any number


class Excite(Law):
    """Random commands around a goal, of a robot in the plane."""

    TASKS: ClassVar[tuple[str, ...]] = ("go_to_position", "go_to_pose")  # with one place to stay around
    HOW: ClassVar[Excitation | None] = None  # in place of that of the robot's family
    law = "excite"
    title = "random commands, to identify the robot by"

    def __init__(
        self, robot: Robot, task: Task, gains: Excitation | None = None, *, control_hz: float | None = None
    ) -> None:
        """Prepare.

        Args:
            robot: The robot.
            task: One of `TASKS`; its goal is the middle of the room.
            gains: How restless; the usual of the robot's family by default.
            control_hz: Command rate; the robot's own by default [Hz].
        """
        if task.kind not in self.TASKS:
            raise ValueError(f"'excite' stays around one place; tasks for that are {', '.join(self.TASKS)}.")
        how = gains or (robot.actuators.excitation and (self.HOW or robot.actuators.excitation))
        if how is None:
            families = ", ".join(kind for kind, family in FAMILIES.items() if family.excitation)
            raise ValueError(f"'excite' drives {families}; '{robot.name}' has {robot.actuators.kind}.")
        self._how = how
        super().__init__(robot, task, self._how, control_hz=control_hz)
        self._off_centre = any(robot.body.center_of_mass)
        self._frame = BodyFrame(robot, task)

    def bind(self) -> None:
        """See `Law.bind`."""
        self._dynamics, self._world = dynamics_of(self.robot, calm()), nominal_worlds(self.robot, 1)

    def reset(self) -> None:
        """Begin the sequence anew."""
        super().reset()
        self._rng = np.random.default_rng(SEED)
        self._left = 0  # control steps that the command is still held
        self._held: np.ndarray | None = None

    def command(self, inputs: Inputs) -> np.ndarray:
        """Hold a command, or choose another one; shapes as in `Controller.act`."""
        if self._held is None or len(self._held) != len(inputs.previous) or self._left <= 0:
            longest = max(1, round(self._how.hold_s * self.control_hz))
            self._left = int(self._rng.integers(1, longest + 1))
            self._held = self._chosen(inputs, self._left)
        self._left -= 1
        return self._held

    def _chosen(self, inputs: Inputs, steps: int) -> np.ndarray:
        how, count = self._how, len(inputs.previous)
        room = how.room * self.robot.limits.geofence
        share = np.minimum(self._distance(inputs) / room, 1.0) ** 2
        allowed = how.near + np.floor((how.far - how.near) * share)  # candidates, shape (rows,)
        # The same ones for every row, so that a row's answer does not depend on its neighbours.
        candidates = np.repeat(self.robot.actuators.random_commands(self._rng, how.far), count, axis=0)
        safe = np.tile(inputs.previous, (how.far, 1)).T
        actuation = actuation_of(self.robot, safe)
        actuation.begin(candidates.T, self._world, None)
        substeps = steps * self.robot.timing.substeps(self.control_hz)
        before = self._around_goal(inputs).mapped(lambda part: np.tile(part, how.far))
        still = (np.zeros(1),) * 3
        after = self._dynamics.move(
            before, actuation, self._world, still, Steps(substeps, off_centre=self._off_centre)
        )
        away, turning = self._departure(after)
        miss, spin = away / room, turning / self.robot.performance.yaw_rate
        cost = (miss**2 + how.calm * spin**2).reshape(how.far, count)
        cost = np.where(np.arange(how.far)[:, None] < allowed, cost, np.inf)
        best = np.argmin(cost, axis=0)
        return np.asarray(candidates.reshape(how.far, count, -1)[best, np.arange(count)])

    def _distance(self, inputs: Inputs) -> np.ndarray:
        """From the goal, shape (n,) [m]."""
        return np.asarray(np.hypot(*self._frame.goal(inputs)))

    def _around_goal(self, inputs: Inputs) -> State:
        """Where n robots are, seen from their goals."""
        x, y = self._frame.goal(inputs)
        return PlanarState(-x, -y, 0.0 * x, *self._frame.motion(inputs))

    def _departure(self, after: Any) -> tuple[np.ndarray, np.ndarray]:
        """Of candidates: distance from the goal, the last velocity gone on [m], and turn rate [rad/s]."""
        ahead = self._how.foresight_s
        return np.hypot(after.x + ahead * after.vx, after.y + ahead * after.vy), after.yaw_rate


class ExciteInSpace(Excite):
    """Random commands around a goal, of a body in space; its attitude does not count."""

    TASKS = ("go_to_position_3d", "go_to_pose_3d")
    # A command that pushes in the world turns with the body: more candidates, and a longer look ahead.
    HOW = Excitation(hold_s=0.6, foresight_s=8.0, near=6, far=48)

    def _distance(self, inputs: Inputs) -> np.ndarray:
        """See `Excite._distance`."""
        return np.asarray(inputs.state.distance_to(inputs.goal.current))

    def _around_goal(self, inputs: Inputs) -> State:
        """See `Excite._around_goal`."""
        state = inputs.state
        away = minus(state.position, position_of(inputs.goal.current))
        return SpatialState(*away, *state.quat, *state.velocity, *state.rate)

    def _departure(self, after: Any) -> tuple[np.ndarray, np.ndarray]:
        """See `Excite._departure`."""
        then = plus(after.position, scaled(self._how.foresight_s, after.velocity))
        return np.asarray(length(then)), np.asarray(length(after.rate))
