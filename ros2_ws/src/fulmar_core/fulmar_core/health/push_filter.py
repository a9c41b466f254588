"""Gains of a Kalman filter for pose, velocity and a push that stays, the same for every hypothesis and every robot.

The covariances of a linear filter do not depend on what is measured (Kalman 1960), so hypotheses that differ in their
input alone share them, and a step of all of them is a product of matrices.
"""

from __future__ import annotations

import numpy as np

from fulmar_core.health.trust import Suspicion
from fulmar_core.robot import Robot

SETTLED = 1e-4  # relative change of a gain from step to step below which it stays


class PushFilter:
    """Three coordinates (x, y, heading), each with velocity and push; states in the order pose, velocity, push."""

    def __init__(self, robot: Robot, suspicion: Suspicion, dt: float) -> None:
        """Prepare for measurements that come every `dt` seconds, a multiple of the physics step."""
        inertia = np.array([robot.body.mass, robot.body.mass, robot.body.inertia[2]])
        s = suspicion
        eye, none = np.eye(3), np.zeros((3, 3))
        # The simulators' semi-implicit Euler steps move a body a little farther than dt²/2.
        half = 0.5 * dt * (dt + robot.timing.physics_dt)
        per_push = np.diag(1.0 / inertia)
        step = np.block([[eye, dt * eye, half * per_push], [none, eye, dt * per_push], [none, none, eye]])
        driven = np.vstack((half * per_push, dt * per_push, none))
        #: One step of states in rows, to multiply from the right, shape (9, 9).
        self.step = np.ascontiguousarray(step.T)
        #: What a wrench does within one step, same, shape (3, 9).
        self.driven = np.ascontiguousarray(driven.T)
        force = np.array([s.model_force] * 2 + [s.model_torque])
        drift = np.array([s.drift_force] * 2 + [s.drift_torque])
        self._noise = (driven * force) @ (driven * force).T
        self._noise[6:, 6:] += dt * np.diag(drift**2)
        self._sensors = np.diag(
            np.array([s.position, s.position, s.heading, s.velocity, s.velocity, s.yaw_rate]) ** 2
        )
        begin = np.diag(self._sensors)
        push = np.array([s.push_force] * 2 + [s.push_torque])
        self._covariance = np.diag([*begin, *push**2])
        self._gains: list[np.ndarray] = []
        self._settled = False

    def gain(self, count: int) -> np.ndarray:
        """Of the measurement after `count` others.

        Returns:
            What innovations in rows are multiplied with from the right, shape (6, 15): nine columns make corrections
            of the state, six make innovations white, so that their squares add up to the square of the Mahalanobis
            distance.
        """
        while len(self._gains) <= count and not self._settled:
            self._gains.append(self._next())
        return self._gains[min(count, len(self._gains) - 1)]

    def _next(self) -> np.ndarray:
        before = self.step.T @ self._covariance @ self.step + self._noise
        spread = before[:6, :6] + self._sensors
        gain = before[:, :6] @ np.linalg.inv(spread)
        after = before - gain @ before[:6]
        self._covariance = 0.5 * (after + after.T)
        both = np.hstack((gain.T, np.linalg.inv(np.linalg.cholesky(spread)).T))
        self._settled = bool(self._gains) and np.allclose(both, self._gains[-1], rtol=SETTLED, atol=0.0)
        return both
