"""Discrete linear-quadratic regulator of a satellite's attitude: of the rotation vector and the turn rate."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.controllers.attitude_law import AttitudeGains, AttitudeLaw
from fulmar_core.controllers.attitude_pd import attitude_bandwidth
from fulmar_core.controllers.lqr import regulator
from fulmar_core.controllers.space_frame import SpaceMotion
from fulmar_core.robots.robot import Robot


@dataclass(frozen=True, kw_only=True)
class AttitudeLqrWeights(AttitudeGains):
    """Weights per second, as read from `configs/controllers/<robot>_lqr.yaml` of a satellite."""

    attitude: float  # per rad²
    rate: float  # per (rad/s)²
    torque: float  # per (N·m)²

    def __post_init__(self) -> None:
        super().__post_init__()
        if min(self.attitude, self.torque) <= 0.0 or self.rate < 0.0:
            raise ValueError("'attitude' and 'torque' must be greater than 0, 'rate' not negative.")


class AttitudeLqr(AttitudeLaw):
    """LQR on the measured or estimated attitude and turn rate, after the gyroscopic feed-forward."""

    law = "lqr"
    title = "LQR of the attitude"

    gains: AttitudeLqrWeights

    def prepare(self) -> None:
        """Solve for the gain; with the feed-forward the body is a double integrator of its inertia."""
        dt, gains, one = 1.0 / self.control_hz, self.gains, np.eye(3)
        lightness = np.linalg.inv(self.inertia)
        a = np.block([[one, dt * one], [0.0 * one, one]])
        b = np.vstack((0.5 * dt * dt * lightness, dt * lightness))
        q = dt * np.diag(np.repeat((gains.attitude, gains.rate), 3))
        self.gain = regulator(a, b, q, dt * gains.torque * one).gain

    def torque(self, turn: np.ndarray, now: SpaceMotion, inertia: np.ndarray) -> np.ndarray:
        """See `AttitudeLaw.torque`."""
        return np.asarray(-np.concatenate((-turn, now.rate), axis=-1) @ self.gain.T)

    def derived(self) -> dict[str, Any]:
        """What else the commands depend on."""
        return super().derived() | {"gain": np.round(self.gain, 9).tolist()}


def attitude_lqr_weights(robot: Robot) -> AttitudeLqrWeights:
    """Weights of a satellite without a file: those of which a body of its largest inertia gets the PD law's bandwidth.

    A double integrator of inertia J with costs q θ² + r τ² has the natural frequency (q / r)^¼ / J^½ and a damping of
    1/√2; a cost of the rate makes it critical (Kwakernaak and Sivan, Linear Optimal Control Systems, 1972, §3.4).
    """
    bandwidth, rate = attitude_bandwidth(robot)
    largest = float(np.linalg.eigvalsh(robot.body.inertia_matrix)[-1])
    attitude, torque = bandwidth**4 * largest**2, 1.0
    return AttitudeLqrWeights(
        attitude=attitude,
        rate=2.0 * bandwidth**2 * largest**2,
        torque=torque,
        attitude_error_limit_deg=math.degrees(2.0 * rate / bandwidth),
    )
