"""Base class of the laws of satellites: a torque for the errors of the attitude, and wheels for the torque.

Torque on the body τ = feedback + ω × (J ω + h) + τ_ext, with h the momentum of the wheels: the gyroscopic feed-forward
leaves a body that turns as if it had no momentum (Wie, Space Vehicle Dynamics and Control, 2008, §7.3).
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.law import Law
from fulmar_core.controllers.space_frame import SpaceFrame, SpaceMotion
from fulmar_core.controllers.target_motion import TargetMotion
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.sensors.wheels import NAME as WHEELS
from fulmar_core.states.attitude import logarithm

# Share of a wheel's momentum from which on it is unloaded, and down to which.
UNLOAD_FROM, UNLOAD_TO = 0.5, 0.1


@dataclass(frozen=True, kw_only=True)
class AttitudeGains:
    """Limits that every law of satellites has."""

    attitude_error_limit_deg: float  # errors beyond count as this, which sets how fast it slews [deg]
    unloading: float = 0.02  # torque against the momentum of the wheels, where there is unloading [1/s]

    def __post_init__(self) -> None:
        if self.attitude_error_limit_deg <= 0.0 or self.unloading < 0.0:
            raise ValueError("'attitude_error_limit_deg' must be greater than 0, 'unloading' not negative.")


class AttitudeLaw(Law):
    """A law for satellites that reaction wheels turn; without measured speeds wheels count as at rest."""

    gains: AttitudeGains
    readings: tuple[str, ...] = (WHEELS,)

    def bind(self) -> None:
        """See `Law.bind`."""
        self._wheels = self.robot.actuated_by(ReactionWheels)
        if np.linalg.matrix_rank(self._wheels.axes) < 3:
            raise ValueError("the axes of its wheels lie in one plane: about one axis it cannot turn.")
        self.frame = SpaceFrame(self.task)
        self._target = TargetMotion(speed=np.inf, rate=self.robot.performance.yaw_rate)
        self._per_torque = np.linalg.pinv(-self._wheels.axes.T)  # commands per torque on the body, (count, 3)
        self.inertia = self.robot.body.inertia_matrix
        self._unloads: np.ndarray | None = None

    def reset(self) -> None:
        """Forget how the target moves, and what is being unloaded."""
        super().reset()
        self._target.reset()
        self._unloads = None

    def command(self, inputs: Inputs) -> np.ndarray:
        """Choose torques of motors and of unloading; shapes as in `Controller.act`."""
        now = self.frame.motion(inputs)
        moved = self._target.update(inputs.goal.current, inputs.stamp_ns, inputs.dt)
        now = self.frame.less_target(now, inputs, moved.motion)
        inertia = self.inertia_of(inputs)
        momentum = self._momentum(inputs)
        gyroscopic = np.cross(now.turning, now.turning @ inertia + momentum)
        torque = (
            self.torque(self._limited(np.stack(logarithm(now.to_goal), axis=-1)), now, inertia) + gyroscopic
        )
        if self._wheels.unloading is None:
            return np.asarray(torque @ self._per_torque.T)
        outside = self._outside(momentum, self._wheels.unloading.torque)
        return np.concatenate(((torque - outside) @ self._per_torque.T, outside), axis=-1)

    @abstractmethod
    def torque(self, turn: np.ndarray, now: SpaceMotion, inertia: np.ndarray) -> np.ndarray:
        """Feedback of the errors.

        Args:
            turn: Rotation vector to the goal's attitude, cut to the limit, shape (n, 3) [rad].
            now: Everything else; `rate` is less that of the goal.
            inertia: Of the spacecraft, shape (3, 3) [kg·m²].

        Returns:
            Torque on the body in its own frame, shape (n, 3) [N·m].
        """

    def inertia_of(self, inputs: Inputs) -> np.ndarray:
        """Inertia to control with, shape (3, 3): that of the robot's file [kg·m²]."""
        return self.inertia

    def _momentum(self, inputs: Inputs) -> np.ndarray:
        """Momentum of the wheels in the body frame, shape (n, 3) [N·m·s]."""
        speeds = inputs.readings.get(WHEELS)
        if speeds is None:
            return np.zeros((len(inputs.previous), 3))
        return self._wheels.to_body(self._wheels.spin_inertia * speeds)

    def _outside(self, momentum: np.ndarray, most: float) -> np.ndarray:
        """Torque of unloading, shape (n, 3) [N·m]: from half of a wheel's momentum on, until little is left."""
        share = np.abs(momentum) / self._wheels.top_momentum
        if self._unloads is None or self._unloads.shape != share.shape:
            self._unloads = np.zeros(share.shape, dtype=bool)
        self._unloads = (share > UNLOAD_FROM) | self._unloads & (share > UNLOAD_TO)
        return np.asarray(np.clip(-self.gains.unloading * momentum * self._unloads, -most, most))

    def _limited(self, turn: np.ndarray) -> np.ndarray:
        length = np.maximum(np.linalg.norm(turn, axis=-1, keepdims=True), 1e-12)
        return np.asarray(turn * np.minimum(1.0, np.radians(self.gains.attitude_error_limit_deg) / length))

    def derived(self) -> dict[str, Any]:
        """What else the commands depend on."""
        return super().derived() | {"unloads_between": [UNLOAD_TO, UNLOAD_FROM]}
