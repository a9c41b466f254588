"""Excitation for identification: random commands that keep the robot in its room.

A run that identifies a model needs every actuator at work, in changing company and for changing times; a controller
that reaches its goal and stops shows little. Random commands alone let a body without friction drift away. So several
random commands are drawn each time, the core predicts where each would lead, and the one that leads back best is taken:
few candidates near the goal, which leaves most of the randomness, more of them farther out.
"""

from __future__ import annotations

import numpy as np

from fulmar_core.actuators.excitation import Excitation
from fulmar_core.actuators.families import FAMILIES
from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.planar_law import PlanarLaw
from fulmar_core.identification.model import nominal_world
from fulmar_core.motion import actuation_of, move
from fulmar_core.planar import PlanarState
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task

TASKS = ("go_to_position", "go_to_pose")  # kinds with one place to stay around
SEED = 5  # of the commands: any number


class Excite(PlanarLaw):
    """Random commands around a goal."""

    law = "excite"
    title = "random commands, to identify the robot by"

    def __init__(
        self, robot: Robot, task: Task, gains: Excitation | None = None, *, control_hz: float | None = None
    ) -> None:
        """Prepare.

        Args:
            robot: The robot.
            task: One of the kinds `TASKS`; its goal is the middle of the room.
            gains: How restless; the usual of the robot's family by default.
            control_hz: Command rate; the robot's own by default [Hz].
        """
        if task.kind not in TASKS:
            raise ValueError(f"'excite' stays around one place; tasks for that are {', '.join(TASKS)}.")
        how = gains or robot.actuators.excitation
        if how is None:
            families = ", ".join(kind for kind, family in FAMILIES.items() if family.excitation)
            raise ValueError(f"'excite' drives {families}; '{robot.name}' has {robot.actuators.kind}.")
        self._how = how
        super().__init__(robot, task, self._how, control_hz=control_hz)
        self._world = nominal_world(robot)
        self._off_centre = any(robot.body.center_of_mass)

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
        x, y = self.frame.goal(inputs)
        u, v, r = self.frame.motion(inputs)
        room = how.room * self.robot.limits.geofence
        share = np.minimum(np.hypot(x, y) / room, 1.0) ** 2
        allowed = how.near + np.floor((how.far - how.near) * share)  # candidates, shape (rows,)
        # The same ones for every row, so that a row's answer does not depend on its neighbours.
        candidates = np.repeat(self.robot.actuators.random_commands(self._rng, how.far), count, axis=0)
        before = PlanarState(*(np.tile(part, how.far) for part in (-x, -y, 0.0 * x, u, v, r)))
        safe = np.tile(inputs.previous, (how.far, 1)).T
        actuation = actuation_of(self.robot, safe)
        actuation.begin(candidates.T, self._world, None)
        still = (np.zeros(1),) * 3
        after = move(
            self.robot,
            before,
            actuation,
            self._world,
            still,
            substeps=steps * self.robot.timing.substeps(self.control_hz),
            latest_s=0.0,
            off_centre=self._off_centre,
        )
        ahead = how.foresight_s
        miss = np.hypot(after.x + ahead * after.vx, after.y + ahead * after.vy) / room
        spin = after.yaw_rate / self.robot.performance.yaw_rate
        cost = (miss**2 + how.calm * spin**2).reshape(how.far, count)
        cost = np.where(np.arange(how.far)[:, None] < allowed, cost, np.inf)
        best = np.argmin(cost, axis=0)
        return np.asarray(candidates.reshape(how.far, count, -1)[best, np.arange(count)])
