"""Base class of the classical laws of bodies in space: a wrench for the errors, and valves or fans for the wrench."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.controllers.allocation import Allocation, allocation_of
from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.delta_sigma import DeltaSigma
from fulmar_core.controllers.law import Law
from fulmar_core.controllers.space_frame import SpaceFrame, SpaceMotion
from fulmar_core.controllers.target_motion import Moved, TargetMotion
from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.states.rotation import cross


@dataclass(frozen=True, kw_only=True)
class SpaceGains:
    """Limits and costs that every law in space has."""

    position_error_limit: float  # errors beyond count as this, which sets the cruising speed [m]
    attitude_error_limit_deg: float  # same for the turn rate [deg]
    braking_force: float  # to brake with, which limits the speed to a goal; 0: no heed [N]
    braking_torque: float  # same for the turn rate [N·m]
    carried_force: (
        float  # that valves owe at most, of each axis; 0 with 'carried_torque' 0: no modulation [N]
    )
    carried_torque: float  # same [N·m]
    open_valve: float  # cost of each open valve, or of a fan at full thrust, per second
    overshoot: float = 0.0  # how far beyond a waypoint to aim where the path goes straight on [m]

    def __post_init__(self) -> None:
        if min(self.position_error_limit, self.attitude_error_limit_deg) <= 0.0:
            raise ValueError("the error limits must be greater than 0.")
        rest = (self.braking_force, self.braking_torque, self.carried_force, self.carried_torque)
        if min(*rest, self.open_valve, self.overshoot) < 0.0:
            raise ValueError("braking, carried, 'open_valve' and 'overshoot' must not be negative.")


class SpaceLaw(Law):
    """A law for bodies in space that valves or fans push one way."""

    gains: SpaceGains
    allocation: Allocation

    def bind(self) -> None:
        """See `Law.bind`."""
        self.frame = SpaceFrame(self.task)
        self._modulation: DeltaSigma | None = None
        can = self.robot.performance
        self._largest_inertia = float(np.linalg.eigvalsh(self.robot.body.inertia_matrix)[-1])
        self._target = TargetMotion(
            speed=can.speed,
            rate=can.yaw_rate,
            acceleration=can.turning_acceleration,
            turning=can.torque / self._largest_inertia,
        )
        self._com = np.array(self.robot.body.com)
        self._inertia = self.robot.body.inertia_matrix

    def allocate_by(self, weight: np.ndarray, *, lead: float, turn_lead: float) -> None:
        """Prepare the allocation and the limits of the errors.

        Args:
            weight: Cost of a wrench error, shape (6, 6).
            lead: How far from the goal the law asks for 1 m/s [s].
            turn_lead: How far from the attitude it asks for 1 rad/s [s].
        """
        gains, actuators = self.gains, self.robot.actuated_by(Pushing)
        self._lead, self._turn_lead = lead, turn_lead
        cost = gains.open_valve / self.control_hz
        self.allocation = allocation_of(actuators, weight=weight, cost=cost)
        most = np.repeat((gains.carried_force, gains.carried_torque), 3)
        if actuators.binary:
            self._modulation = DeltaSigma(self.allocation, actuators, most=most)

    def reset(self) -> None:
        """Forget what the valves owe, and how the target moves."""
        super().reset()
        self._target.reset()
        if self._modulation is not None:
            self._modulation.reset()

    def command(self, inputs: Inputs) -> np.ndarray:
        """Choose commands; shapes as in `Controller.act`."""
        now, moved = self.frame.motion(inputs), None
        if not self.frame.tracks and not self.frame.passes:
            moved = self._moved(inputs)
            now = self.frame.less_target(now, inputs, moved.at_end)
        wrench = self.wrench(self._way(inputs, now), now)
        if moved is not None and moved.change.any():
            push, turn = self.frame.of_target(now, inputs, moved.change)
            wrench = wrench + np.concatenate((self.robot.body.mass * push, turn @ self._inertia), axis=-1)
        # Allocations count torques about the body's origin.
        wrench[..., 3:] += cross(self._com, wrench[..., :3])
        best = self.allocation if self._modulation is None else self._modulation
        return np.asarray(best.best(wrench, now.alive))

    def _moved(self, inputs: Inputs) -> Moved:
        """How the target moves: as its task knows it, or by the difference to the step before."""
        task: Any = self.task
        if not self.task.moves:
            return self._target.update(inputs.goal.current, inputs.stamp_ns, inputs.dt)
        now = task.reference_of(inputs.goal)
        return Moved(now.motion, now.change, 0.0)

    @abstractmethod
    def wrench(self, way: np.ndarray, now: SpaceMotion) -> np.ndarray:
        """Wrench that the actuators should bring up.

        Args:
            way: To the goal, cut to what the law shall see of it, shape (n, 3) [m].
            now: Everything else.

        Returns:
            Force and torque about the centre of mass in the body's frame, shape (n, 6) [N, N·m].
        """

    def limited_turn(self, error: np.ndarray) -> np.ndarray:
        """An error of the attitude with the same axis, cut to the limits, shape (n, 3) [rad]."""
        gains = self.gains
        braking = gains.braking_torque / self._largest_inertia
        return _cut(error, np.deg2rad(gains.attitude_error_limit_deg), braking, self._turn_lead)

    def turning_force(self, now: SpaceMotion) -> np.ndarray:
        """Force that keeps a velocity in the body's frame while it turns, m ω × v, shape (n, 3) [N]."""
        return np.asarray(self.robot.body.mass * cross(now.turning, now.moving))

    def gyroscopic(self, now: SpaceMotion) -> np.ndarray:
        """ω × J ω, shape (n, 3) [N·m]."""
        return np.asarray(cross(now.turning, now.turning @ self._inertia))

    def _way(self, inputs: Inputs, now: SpaceMotion) -> np.ndarray:
        """Way to aim at, beyond waypoints where the path goes straight on, cut to the limits."""
        way, gains = now.way, self.gains
        if self.frame.passes and gains.overshoot and not self.frame.heads:
            leg = self.frame.next_leg(inputs)
            far, along = _length(way), _length(leg)
            onward = np.maximum(np.sum(way * leg, axis=-1, keepdims=True) / (far * along), 0.0)
            way = way * (1.0 + gains.overshoot * onward / far)
        return _cut(way, gains.position_error_limit, gains.braking_force / self.robot.body.mass, self._lead)


def _cut(error: np.ndarray, most: float, braking: float, lead: float) -> np.ndarray:
    """An error cut to a limit, and to where the law asks for the speed that still can be braked.

    Args:
        error: Shape (n, 3).
        most: Limit of its length.
        braking: Deceleration; 0: no heed.
        lead: Error for which the law asks for a speed of 1 [s].
    """
    length = _length(error)
    limit = np.full_like(length, most)
    if braking > 0.0:
        limit = np.minimum(limit, lead * np.sqrt(2.0 * braking * length))
    return np.asarray(error * np.minimum(1.0, limit / length))


def _length(vectors: np.ndarray) -> np.ndarray:
    """Lengths, no less than a nanometre, shape (n, 1)."""
    return np.asarray(np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9))
