"""Backup of boats and wheels: the robot's own law stops it, then holds it at a point inside."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.controller import Inputs
from fulmar_core.estimators.actuator_health.actuator_estimator import ActuatorEstimate
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.envelope.backup import INSET_M, LARGEST_INSET
from fulmar_core.safety.envelope.lean.track import PlaneBounds
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goals_at

HOLD, BRAKE = TASKS = "go_to_position", "track_velocities"  # of the law that holds, and of that which stops
STANDS = 0.06  # of the robot's top speed: a slower one counts as stopped [-]


class StopAndHold:
    """Brings n robots to a stop, and then holds each at its own point.

    Attributes:
        law: The robot's usual law for a place.
    """

    def __init__(self, robot: Robot, control_hz: float, bounds: PlaneBounds) -> None:
        """Load the law.

        Args:
            robot: A boat, or one on wheels.
            control_hz: Command rate [Hz].
            bounds: Inside which it is held.

        Raises:
            ConfigError: No law takes this robot to places.
        """
        self.law = load_classical(robot, load_task(HOLD), control_hz=control_hz)
        self._brake = load_classical(robot, load_task(BRAKE), control_hz=control_hz)
        self._form, self._slow = robot.state_type, STANDS * robot.performance.top_speed
        inset = np.minimum(INSET_M, LARGEST_INSET * (bounds.high - bounds.low))
        self._low, self._high = bounds.low + inset, bounds.high - inset
        self.reset()

    def reset(self) -> None:
        """Forget the past."""
        self.law.reset()
        self._brake.reset()
        self._targets: np.ndarray | None = None  # shape (n, 3)
        self._brakes = np.zeros(0, dtype=bool)

    def stop(self, which: np.ndarray, now: RigidBodyState, stops_at: np.ndarray) -> None:
        """Choose anew where some robots stop; arguments as in `envelope.backup.Backup.stop`."""
        place = np.array(stops_at)
        axes = len(self._low)
        place[:, :axes] = np.clip(place[:, :axes], self._low, self._high)
        targets = self._form.targets_of(np.concatenate((place, now.quat_xyzw), axis=1))
        if self._targets is None or len(self._targets) != len(targets):
            self._targets, self._brakes = np.array(targets), np.zeros(len(targets), dtype=bool)
        self._targets[which] = targets[which]
        self._brakes = self._brakes | which

    def free(self, which: np.ndarray) -> None:
        """Leave some robots to their controllers, shape (n,)."""
        self._brakes = self._brakes & ~which

    def command(self, inputs: Inputs, estimate: ActuatorEstimate | None) -> np.ndarray:
        """Commands that stop or hold the robots, before the actuators' limits, shape (n, m).

        Args:
            inputs: Of the control step.
            estimate: Not used: no law of these robots asks for one.
        """
        assert self._targets is not None, "no point to stop at was chosen"
        rigid = inputs.state.to_rigid()
        speed = np.linalg.norm(rigid.velocity_in_world[:, :2], axis=1)
        self._brakes = self._brakes & (speed > self._slow)
        known = replace(inputs, estimates=None, believed=None)
        hold = self.law.command(replace(known, goal=goals_at(self._targets)))
        if not self._brakes.any():
            return np.asarray(hold)
        still = goals_at(np.zeros((len(speed), 3)))
        stop = self._brake.command(replace(known, goal=still))
        return np.asarray(np.where(self._brakes[:, None], stop, hold))
