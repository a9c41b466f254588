"""Backup of the envelope guard: the robot's own law holds it at a point where it can stop within its area."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.controller import Inputs
from fulmar_core.estimators.actuator_health.actuator_estimator import ActuatorEstimate
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.envelope.blocks import Blocks
from fulmar_core.safety.envelope.braking import Braking
from fulmar_core.states.attitude import exponential
from fulmar_core.states.rotation import multiply
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goals_at

INSET_M = 0.6  # of the points to stop at, from each side of the area [m]
LARGEST_INSET = 0.3  # of the same, as a share of the area's width


class Backup:
    """Brings n bodies to a stop, and holds each at its own point.

    Attributes:
        law: The robot's usual law for a pose.
    """

    def __init__(
        self,
        robot: Robot,
        braking: Braking,
        control_hz: float,
        low: np.ndarray,
        high: np.ndarray,
        *,
        blocks: Blocks | None = None,
    ) -> None:
        """Load the law.

        Args:
            robot: One that floats.
            braking: How well it brakes.
            control_hz: Command rate [Hz].
            low: Least coordinates of the area, shape (2,), (3,) or, without an area, (0,) [m].
            high: Greatest ones, same shape.
            blocks: Keeps these points clear of obstacles; None where these do not count.

        Raises:
            ConfigError: No law holds a pose of this robot.
        """
        task = load_task(f"go_to_pose{robot.state_type.SUFFIX}")
        self.law = load_classical(robot, task, control_hz=control_hz)
        self._form, self._braking = robot.state_type, braking
        inset = np.minimum(INSET_M, LARGEST_INSET * (high - low))
        self._low, self._high = low + inset, high - inset
        self._targets: np.ndarray | None = None  # shape (n, 3), in space (n, 7)
        self._blocks = blocks

    def reset(self) -> None:
        """Forget the past."""
        self.law.reset()
        self._targets = None

    def stop(
        self, which: np.ndarray, now: RigidBodyState, stops_at: np.ndarray, discs: np.ndarray | None = None
    ) -> None:
        """Choose anew where some bodies stop.

        Args:
            which: True for these, shape (n,).
            now: Of all, shapes (n,).
            stops_at: Where each would stop, shape (n, 3) [m].
            discs: Obstacles, as in `Blocks`; None for none.
        """
        place = np.array(stops_at)
        axes = len(self._low)
        place[:, :axes] = np.clip(place[:, :axes], self._low, self._high)
        if discs is not None and self._blocks is not None:
            free = self._blocks.clear(place, discs)
            blocked = self._blocks.crosses(now.position_in_world, free, discs)
            place = np.where(blocked[:, None], self._blocks.clear(np.array(stops_at), discs), free)
        rate = now.angular_velocity_in_body
        turns = np.sqrt((rate * rate).sum(axis=1, keepdims=True))
        # A body that turns goes on until full torque has stopped it: it need not turn back afterwards.
        on = exponential(tuple((rate * turns / (2.0 * self._braking.turning)).T))
        quat = multiply(now.quat_xyzw, np.stack(on, axis=-1))
        targets = self._form.targets_of(np.concatenate((place, quat), axis=1))
        if self._targets is None or len(self._targets) != len(targets):
            self._targets = np.array(targets)
        self._targets[which] = targets[which]

    def command(self, inputs: Inputs, estimate: ActuatorEstimate | None) -> np.ndarray:
        """Commands towards the chosen points, before the actuators' limits, shape (n, m).

        Args:
            inputs: Of the control step.
            estimate: Of the law's own estimator; None where it has none.
        """
        assert self._targets is not None, "no point to stop at was chosen"
        goal = goals_at(self._targets)
        return np.asarray(self.law.command(replace(inputs, goal=goal, estimates=estimate, believed=None)))
