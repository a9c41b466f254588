"""Estimate of what pushes a robot, which of its valves work and how it really moves, for the controller's use."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.health.applied import Applied
from fulmar_core.health.thruster_health import Health, ThrusterHealth
from fulmar_core.health.trust import Suspicion
from fulmar_core.health.valve_trials import ValveTrials
from fulmar_core.planar import PlanarState, to_body
from fulmar_core.robot import Robot


@dataclass(frozen=True, slots=True)
class ActuatorEstimate:
    """Estimate at one measurement, of n robots side by side."""

    state: PlanarState  # without measurement noise, in the odometry's frame, shapes (n,)
    push: np.ndarray  # force ahead and to the left, and torque, from outside, shape (n, 3) [N, N, N·m]
    alive: np.ndarray  # 1, or 0 for a valve that should stay closed, shape (n, m) [-]
    health: Health  # what it follows from; `push` in there lies in the odometry's frame


class ActuatorEstimator:
    """Bank of filters over lost valves, with trials of those that are believed dead; see `ThrusterHealth`."""

    def __init__(self, robot: Robot, suspicion: Suspicion) -> None:
        """Build the filters.

        Args:
            robot: A planar robot on air, with thrusters.
            suspicion: How far to trust what.

        Raises:
            ConfigError: The robot has no thrusters, or swims.
        """
        self._health = ThrusterHealth(robot, suspicion)
        self._trials = ValveTrials(suspicion.retry_s) if suspicion.retry_s else None

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
