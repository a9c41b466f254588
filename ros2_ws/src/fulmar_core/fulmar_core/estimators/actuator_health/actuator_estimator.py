"""Actuator estimator: external push, working valves and filtered motion, for the controller's use."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.estimators.actuator_health.applied import Applied
from fulmar_core.estimators.actuator_health.filters import HealthSettings
from fulmar_core.estimators.actuator_health.thruster_health import Health, ThrusterHealth
from fulmar_core.robots.robot import Robot
from fulmar_core.states.planar import PlanarState, to_body

LONGEST_S = 60.0  # each further trial waits twice as long, up to this [s]
# A valve has had its trial once it was open for so long: that distinguishes a dead valve from a good one [s]
OPENINGS_S = 0.2


class ValveTrials:
    """Trials of valves that are believed dead: each is opened again now and then; arrays of shape (..., n).

    A valve that is never opened shows nothing, so a wrong belief would stay, and a valve could not recover.
    """

    def __init__(self, retry_s: float) -> None:
        """Begin with valves that were never believed dead.

        Args:
            retry_s: A valve has its first trial so long after it was believed dead, > 0 [s].
        """
        self._retry_s = retry_s
        self.reset()

    def reset(self) -> None:
        """Forget every trial."""
        self._dead_s: np.ndarray | None = None  # since it is believed dead, or since its last trial [s]

    def allowed(self, alive: np.ndarray, opened: np.ndarray | None, dt: float) -> np.ndarray:
        """Which valves may be opened now.

        Args:
            alive: 1, or 0 for valves that are believed dead, shape (..., n).
            opened: What was open since the last call, same shape, 1 for open; None where that is not known.
            dt: Time since the last call [s].

        Returns:
            1 for those that are alive or have their trial, else 0; same shape.
        """
        dead = np.asarray(alive) < 0.5
        if not dead.any() and (self._dead_s is None or opened is not None):
            self._dead_s = None
            return alive
        if self._dead_s is None or self._dead_s.shape != dead.shape:
            self._dead_s = np.zeros(dead.shape)
            self._wait_s = np.full(dead.shape, self._retry_s)
            self._tried_s = np.zeros(dead.shape)
        self._dead_s = np.where(dead, self._dead_s + dt, 0.0)
        on_trial = dead & (self._dead_s >= self._wait_s)
        if opened is not None:
            self._tried_s = np.where(on_trial, self._tried_s + dt * (np.asarray(opened) > 0.0), 0.0)
        over = on_trial & (self._tried_s >= OPENINGS_S - 1e-6)
        self._wait_s = np.where(
            dead, np.where(over, np.minimum(2.0 * self._wait_s, LONGEST_S), self._wait_s), self._retry_s
        )
        self._dead_s = np.where(over, 0.0, self._dead_s)
        return np.where(on_trial & ~over, 1.0, alive)


@dataclass(frozen=True, slots=True)
class ActuatorEstimate:
    """Estimate at one measurement, of n robots side by side."""

    state: PlanarState  # without measurement noise, in the odometry's frame, shapes (n,)
    push: np.ndarray  # force ahead and to the left, and torque, from outside, shape (n, 3) [N, N, N·m]
    alive: np.ndarray  # 1, or 0 for a valve that should stay closed, shape (n, m) [-]
    health: Health  # what it follows from; `push` in there lies in the odometry's frame


def sure_of(alive: np.ndarray, state: PlanarState) -> ActuatorEstimate:
    """What is known where nothing is estimated but which actuators work.

    Args:
        alive: 1, or 0 for a dead one, shape (n, m).
        state: As measured, shapes (n,).
    """
    still, push = np.column_stack(state.columns()), np.zeros((len(alive), 3))
    health = Health(alive, alive, still, push, np.zeros(len(alive), dtype=bool))
    return ActuatorEstimate(state, push, alive, health)


class ActuatorEstimator:
    """Bank of filters over lost valves, with trials of those that are believed dead; see `ThrusterHealth`."""

    def __init__(self, robot: Robot, settings: HealthSettings) -> None:
        """Build the filters for a planar robot on air with thrusters.

        Raises:
            ConfigError: The robot has no thrusters, or swims.
        """
        self._health = ThrusterHealth(robot, settings)
        self._trials = ValveTrials(settings.retry_s) if settings.retry_s else None

    def reset(self) -> None:
        """Forget everything."""
        self._health.reset()
        if self._trials is not None:
            self._trials.reset()

    def update(
        self, measured: PlanarState, applied: np.ndarray | Applied | None, passed_s: float
    ) -> ActuatorEstimate:
        """Take a measurement.

        Args:
            measured: Odometry now, shapes (n,); another n than before begins anew.
            applied: What the valves did since the last measurement, shape (n, m), or several commands of one robot;
                None where that is not known: then nothing is learned of valves and push.
            passed_s: Time since the last measurement, a multiple of the physics step [s].
        """
        health = self._health.see(measured, applied, passed_s)
        state = PlanarState(*(health.motion[..., i] for i in range(6)))
        push = health.push.copy()
        push[..., 0], push[..., 1] = to_body(state.yaw, push[..., 0], push[..., 1])
        alive = health.alive
        if self._trials is not None:
            opened = applied.commands.max(axis=0) if isinstance(applied, Applied) else applied
            alive = self._trials.allowed(alive, opened, passed_s)
        return ActuatorEstimate(state, push, alive, health)
