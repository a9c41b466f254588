"""Estimated disturbances as inputs of a network: what pushes the robot, and which valves are dead.

A feed-forward network cannot estimate them by itself, and without them it leans into every push. A network that takes
them has their names in its passport, behind those of the observation.
"""

from __future__ import annotations

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.estimators.actuator_health.actuator_estimator import ActuatorEstimate
from fulmar_core.estimators.actuator_health.filters import HealthSettings
from fulmar_core.estimators.actuator_health.thruster_health import can_estimate_health
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks.observation import Observer

PUSH_TERMS = ("push_x_in_body", "push_y_in_body", "push_torque")  # [N, N, N·m]
# Networks learn on an estimator that takes no body for held and has no valve tried again.
ESTIMATOR = HealthSettings(held=0.0, retry_s=0.0)


def disturbance_terms(robot: Robot) -> tuple[str, ...]:
    """Names of the inputs: the push, and 1 for each valve, or 0 where it is dead; none of robots without valves."""
    if not can_estimate_health(robot):
        return ()
    return (*PUSH_TERMS, *(f"{name}_alive" for name in robot.actuators.names))


def with_disturbances(observer: Observer, inputs: Inputs) -> np.ndarray:
    """Observation of the estimated motion, less noisy than the measured one, with `disturbance_terms`, shape (n, k)."""
    estimate = inputs.estimates
    assert isinstance(estimate, ActuatorEstimate)
    observation = observer(estimate.state, inputs.goal, inputs.previous)
    return np.column_stack((observation, estimate.push, estimate.alive))
