"""Excitation for identification: random commands that keep the robot in its room.

A run that identifies a model needs every actuator at work, in changing company and for changing times; a controller
that reaches its goal and stops shows little. Random commands alone let a body without friction drift away. So several
random commands are drawn each time, the core predicts where each would lead, and the one that leads back best is taken:
few candidates near the goal, which leaves most of the randomness, more of them farther out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.actuators.thrusters import Thrusters
from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.law import Law
from fulmar_core.identification.model import nominal_world
from fulmar_core.motion import actuation_of, move
from fulmar_core.planar import PlanarState
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task

TASKS = ("go_to_position", "go_to_pose")  # kinds with one place to stay around
SEED = 5  # of the commands: any number


@dataclass(frozen=True)
class Excitation:
    """How restless; our values."""

    hold_s: float  # longest time that a command is held [s]
    foresight_s: float  # how long a candidate's last velocity is thought to go on [s]
    near: int = 3  # candidates around the goal
    far: int = 24  # candidates at the end of the room and beyond
    room: float = 0.25  # radius to stay in, of the geofence's [-]
    calm: float = 1.0  # weight of turning against a candidate; water and wheels end it by themselves [-]


# A platform's valves in the rhythm of its commands; propellers and wheels long enough to come up to speed, and to stop.
EXCITATIONS = {
    "thrusters": Excitation(hold_s=0.6, foresight_s=2.0),
    "propellers": Excitation(hold_s=6.0, foresight_s=2.0, calm=0.0),
    "differential_drive": Excitation(hold_s=1.5, foresight_s=1.0),
    "ackermann": Excitation(hold_s=1.5, foresight_s=1.0),
}


class Excite(Law):
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
        if robot.actuators.kind not in EXCITATIONS:
            raise ValueError(
                f"'excite' drives {', '.join(EXCITATIONS)}; '{robot.name}' has {robot.actuators.kind}."
            )
        self._how = gains or EXCITATIONS[robot.actuators.kind]
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
        candidates = np.repeat(self._drawn(how.far), count, axis=0)
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

    def _drawn(self, count: int) -> np.ndarray:
        """Random commands, shape (count, m): one to three valves, or anything between full astern and full ahead."""
        actuators, scale = self.robot.actuators, self.robot.actuators.scale
        if isinstance(actuators, Thrusters):
            order = np.argsort(self._rng.random((count, len(scale))), axis=1)
            opened = order < self._rng.integers(1, 4, size=(count, 1))
            degree = self._rng.random((count, len(scale))) if actuators.continuous else 1.0
            return np.asarray(opened * degree, dtype=float)
        return np.asarray(actuators.limited(self._rng.uniform(-1.0, 1.0, (count, len(scale))) * scale))
