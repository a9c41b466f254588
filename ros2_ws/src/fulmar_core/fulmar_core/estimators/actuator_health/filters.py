"""Filters behind the thruster health: their settings, push estimation, and detection of a held body."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from fulmar_core.robots.robot import Robot

MAY_BE_0 = ("held", "retry_s")


@dataclass(frozen=True)
class HealthSettings:
    """Settings of the thruster health: how far to trust model and measurements.

    Standard deviations and chances; our values, chosen on the conditions of the DRIFT benchmark.
    """

    position: float = 0.0015  # of a measured coordinate [m]
    heading: float = 0.003  # [rad]
    velocity: float = 0.03  # of a measured velocity; uniform ± 0.04 m/s are 0.023 m/s [m/s]
    yaw_rate: float = 0.03  # [rad/s]
    model_force: float = 0.087  # of what the model leaves out, anew at each step [N]
    model_torque: float = 0.035  # same [N·m]
    push_force: float = 0.3  # of a force from outside at the beginning [N]
    push_torque: float = 0.05  # same [N·m]
    drift_force: float = 0.06  # of its change in one second; an uneven floor changes with the place [N]
    drift_torque: float = 0.003  # same [N·m]
    failure: float = 0.02  # chance that an actuator is lost, before anything is seen [-]
    change: float = 1e-3  # chance that what is lost changes, in one second [-]
    # Evidence that the body is held rather than its valves dead, as log-likelihood: two dead valves are 8, and a hold
    # is rarer than they are. 0: it is never taken for held [-].
    held: float = 12.0
    # A valve that is believed dead is opened once more after so long, and again after twice as long: a trial of a dead
    # valve costs one opening without effect. 0: never [s].
    retry_s: float = 6.0
    surprise: float = 16.0  # largest weight of one measurement against a hypothesis, as log-likelihood [-]

    def __post_init__(self) -> None:
        if min(getattr(self, field.name) for field in fields(self) if field.name not in MAY_BE_0) <= 0.0:
            raise ValueError(
                "every number of the health settings must be greater than 0; 'held' and 'retry_s' may be 0."
            )
        if min(getattr(self, name) for name in MAY_BE_0) < 0.0:
            raise ValueError("'held' and 'retry_s' must not be negative.")
        if max(self.failure, self.change) >= 0.5:
            raise ValueError("'failure' and 'change' must be less than one half.")


SETTLED = 1e-4  # relative change of a gain from step to step below which it stays


class PushFilter:
    """Gains of a Kalman filter for pose, velocity and a constant push, the same for every hypothesis and every robot.

    The covariances of a linear filter do not depend on what is measured (Kalman 1960), so hypotheses that differ in
    their input alone share them, and a step of all of them is a product of matrices. Three coordinates (x, y,
    heading), each with velocity and push; states in the order pose, velocity, push.
    """

    def __init__(self, robot: Robot, settings: HealthSettings, dt: float) -> None:
        """Prepare for measurements that come every `dt` seconds, a multiple of the physics step."""
        inertia = np.array([robot.body.mass, robot.body.mass, robot.body.inertia[2]])
        s = settings
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


ALLOWANCE = 1.0  # evidence that is forgotten in one second: errors of the model add up slowly [-]
MOST = 6.0  # evidence of one measurement at most, as log-likelihood [-]
RELEASE = 6.0  # evidence for motion that ends a standstill: a third of a second of full thrust [-]


class HoldDetector:
    """Evidence that something keeps bodies from moving: a hand, a cable, or the floor under an air bearing without air.

    A body that does not move although its valves open is explained by dead valves and pushes, too, so a bank of
    hypotheses about those learns nonsense while a person holds the robot. This is the test against it: a cumulative
    sum (Page 1954, "Continuous inspection schemes") of how much better standing still explains the measurements than
    the whole bank does. Up to two dead valves explain a standstill as well; what they cannot explain is that none of
    several valves has an effect. Arrays of shape (...,).
    """

    def __init__(self, settings: HealthSettings, shape: tuple[int, ...]) -> None:
        s = settings
        self._spread = np.array([s.position, s.position, s.heading, s.velocity, s.velocity, s.yaw_rate])
        self._limit = s.held
        self._evidence = np.zeros(shape)
        self._place: np.ndarray | None = (
            None  # mean pose since the evidence began, shape (..., 3) [m, m, rad]
        )
        self._count, self._begun = np.ones(shape), 0.0  # measurements in it; and whether there are any
        self.held = np.zeros(shape, dtype=bool)

    @property
    def innocent(self) -> np.ndarray:
        """Where nothing speaks for a hold."""
        return np.asarray((self._evidence <= 0.0) & ~self.held)

    def update(self, seen: np.ndarray, surprise: np.ndarray, thrust: np.ndarray, dt: float) -> None:
        """Take a measurement.

        Args:
            seen: Pose, velocity and turn rate, shape (..., 6).
            surprise: Of the hypotheses for a free body, all together: negative log-likelihood of the measurement.
            thrust: Whether valves were open since the last measurement; without, a standstill shows nothing.
            dt: How long that was [s].
        """
        if self._place is None:
            self._place = seen[..., :3]
        off = seen.copy()
        off[..., :3] -= self._place
        off[..., 2] -= 2.0 * np.pi * (off[..., 2] / (2.0 * np.pi)).round()
        errors = off / self._spread
        errors[..., :3] = off[..., :3] / (self._spread[:3] * np.sqrt(1.0 + 1.0 / self._count)[..., None])
        still = 0.5 * (errors * errors).sum(axis=-1)
        gain = np.where(thrust | (still > surprise), (surprise - still).clip(-MOST, MOST), 0.0)
        if self.held.any():
            evidence = self._evidence + gain - np.where(self.held, 0.0, ALLOWANCE * dt)
            self._evidence = evidence.clip(0.0, np.where(self.held, RELEASE, np.inf))
            self.held = np.where(self.held, self._evidence > 0.0, self._evidence > self._limit)
        else:
            self._evidence = np.maximum(self._evidence + gain - ALLOWANCE * dt, 0.0)
            self.held = self._evidence > self._limit
        if self.held.any():
            self._evidence = np.where(self.held, np.minimum(self._evidence, RELEASE), self._evidence)
        anew = self._evidence <= 0.0
        self._count = np.where(anew, 1.0, self._count + self._begun)
        self._begun = 1.0
        self._place = np.where(
            anew[..., None], seen[..., :3], self._place + off[..., :3] / self._count[..., None]
        )
