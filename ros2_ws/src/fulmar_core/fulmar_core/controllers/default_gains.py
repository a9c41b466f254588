"""Default gains of the classical laws, computed from a robot's own limits.

A robot whose YAML is all there is drives with these; `configs/controllers/<robot>_<law>.yaml` takes their place. The
weights of the LQR follow Bryson's rule, 1 / max² (Bryson and Ho, "Applied Optimal Control", 1975, §5.2). The gains of
the guidance laws are inverse time constants: an outer loop is no faster than its actuators follow, and asks for no
more acceleration than they give. Shares without a unit are our values; they are near what searches over closed loops
found for the robots that come with gains.
"""

from __future__ import annotations

import math
from dataclasses import fields, is_dataclass, replace
from typing import TypeVar

import numpy as np

from fulmar_core.controllers.line_of_sight import LineOfSightGains
from fulmar_core.controllers.lqr import LqrWeights
from fulmar_core.controllers.polar import PolarGains
from fulmar_core.controllers.pure_pursuit import PurePursuitGains
from fulmar_core.estimators.actuator_health.filters import HealthSettings
from fulmar_core.estimators.actuator_health.thruster_health import can_estimate_health
from fulmar_core.robots.actuators.ackermann import GRIP, Ackermann
from fulmar_core.robots.actuators.differential_drive import DifferentialDrive
from fulmar_core.robots.actuators.propellers import Propellers
from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.robots.robot import Robot
from fulmar_core.states.gravity import GRAVITY

Gains = TypeVar("Gains")
# The LQR asks for full thrust at these errors: half of what the tasks tolerate [m], [rad].
PRECISION, HEADING_PRECISION = 0.05, math.radians(5.0)
# A faster outer loop gains nothing on the tasks' scale of metres and passes the noise of the heading on [1/s].
FASTEST = 4.0
# `HealthSettings` was chosen for valves of so much each, those of configs/robots/floating_platform.yaml [N], [N·m].
SUSPECTED_FORCE, SUSPECTED_TORQUE = 1.0, 0.31
DIRECTIONS = np.stack([(np.cos(angle), np.sin(angle)) for angle in np.radians(np.arange(360))])


def lqr_weights(robot: Robot) -> LqrWeights:
    """Weights of the LQR by Bryson's rule, for a planar robot with thrusters or fans.

    The largest force and torque are what these bring up in their weakest direction. The largest velocity is the
    largest error divided by the time in which full thrust crosses it, and that time spans a few control steps at least:
    on/off valves cannot act within one.

    Raises:
        ValueError: They do not push in every direction, or do not turn it both ways.
    """
    thrusters = robot.actuated_by(Pushing)
    force = _least(thrusters, [0, 1], DIRECTIONS)
    torque = _least(thrusters, [5], np.array([[1.0], [-1.0]]))
    strongest = float(thrusters.full_thrust.max())
    if force < 1e-3 * strongest or torque < 1e-3 * strongest * robot.body.radius:
        raise ValueError(f"the {thrusters.kind} do not push in every direction and turn both ways.")
    step = robot.timing.control_s
    settling = max(3.0 * step, math.sqrt(2.0 * PRECISION * robot.body.mass / force))
    turning = max(2.5 * step, math.sqrt(2.0 * HEADING_PRECISION * robot.body.inertia[2] / torque))
    return LqrWeights(
        position=1.0 / PRECISION**2,
        heading=1.0 / HEADING_PRECISION**2,
        velocity=(settling / PRECISION) ** 2,
        yaw_rate=(turning / HEADING_PRECISION) ** 2,
        force=1.0 / force**2,
        torque=1.0 / torque**2,
        open_valve=0.2,  # of what full thrust costs
        open_valve_far=2.0,
        position_error_limit=1.5,
        heading_error_limit_deg=180.0,
        # One control step of an on/off valve spins a light body up by more than the tasks tolerate.
        tracking_torque=20.0 / torque**2 if thrusters.binary else 0.0,
        overshoot=1.0,
        braking=0.6,  # the rest is for pushes, and for a body that is heavier than written down
        least_open_s=0.04 if thrusters.binary else 0.0,
        observer=_health_settings(robot, thrusters) if can_estimate_health(robot) else None,
        speed_around=0.4,
    )


def _least(thrusters: Pushing, columns: list[int], directions: np.ndarray) -> float:
    """Largest force or torque that valves or fans bring up in every direction.

    Args:
        thrusters: The bank.
        columns: Of the wrench [N, N, N, N·m, N·m, N·m].
        directions: Unit vectors of these columns, shape (k, columns).
    """
    along = np.maximum(
        thrusters.full_thrust[:, None] * thrusters.wrench_per_newton[:, columns] @ directions.T, 0.0
    )
    most = along.max(axis=0) if thrusters.shared_pressure else along.sum(axis=0)
    return float(most.min())


def _health_settings(robot: Robot, thrusters: Pushing) -> HealthSettings:
    """The observer's own defaults, in proportion to one valve, and no less noise than the robot's sensors have."""
    usual, sensors = HealthSettings(), robot.sensors.odometry
    thrust = float(thrusters.full_thrust.max())
    pushes = thrust / SUSPECTED_FORCE
    turns = thrust * float(np.abs(thrusters.wrench_per_newton[:, 5]).max()) / SUSPECTED_TORQUE
    return HealthSettings(
        position=max(usual.position, 1.5 * sensors.position.std),
        heading=max(usual.heading, 1.5 * sensors.heading.std),
        velocity=max(usual.velocity, 1.5 * sensors.velocity.std),
        yaw_rate=max(usual.yaw_rate, 1.5 * sensors.yaw_rate.std),
        model_force=usual.model_force * pushes,
        model_torque=usual.model_torque * turns,
        push_force=usual.push_force * pushes,
        push_torque=usual.push_torque * turns,
        drift_force=usual.drift_force * pushes,
        drift_torque=usual.drift_torque * turns,
    )


def polar_gains(robot: Robot) -> PolarGains:
    """Gains of the polar law: turning is as fast as wheels and body follow, driving a third of that."""
    drive = robot.actuated_by(DifferentialDrive)
    slew = drive.response.slew or (math.inf, math.inf)
    acceleration = min(slew[0], 2.0 * drive.wheel_force / robot.body.mass)
    angular = min(slew[1], drive.wheel_force * drive.track / robot.body.inertia[2])
    bearing = min(FASTEST, 0.8 / _reaction_s(robot), 2.0 * angular / drive.max_yaw_rate)
    distance = min(0.35 * bearing, 0.8 * acceleration / drive.max_speed)
    return PolarGains(
        distance=distance,
        bearing=bearing,
        heading=-0.22 * bearing,
        turn=bearing,
        near=_near(robot),
        slowing=1.5,
        corner=0.1,
        velocity=0.3,
        speed_around=1.0,
    )


def line_of_sight_gains(robot: Robot) -> LineOfSightGains:
    """Gains of the line of sight: the heading is as fast as propellers and hull follow, the rest in proportion."""
    propellers, water = robot.actuated_by(Propellers), robot.hydrodynamics
    arms, (astern, ahead) = propellers.lever_arms, (-propellers.curve[0], propellers.curve[-1])
    if not np.ptp(arms) > 0.0:
        raise ValueError("the propellers are not side by side, so they do not turn the boat.")
    count = len(arms)
    moment = float(np.where(arms > 0.0, ahead * arms, -astern * arms).sum())
    added = water.planar_added_mass if water else (0.0, 0.0, 0.0)
    mass, inertia = robot.body.mass + added[0], robot.body.inertia[2] + added[2]
    top = min(_terminal(robot, 0, count * ahead), robot.performance.top_speed)
    top_astern = min(_terminal(robot, 0, count * astern), robot.performance.top_speed)
    turn = min(_terminal(robot, 5, moment), robot.limits.yaw_rate)
    slew_s = 1.0 / min(propellers.response.slew) if propellers.response.slew else 0.0
    heading = min(FASTEST, 0.8 / (_reaction_s(robot) + slew_s), 0.5 * moment / inertia / turn)
    return LineOfSightGains(
        cruise=0.6 * top,
        astern=0.75 * top_astern,
        approach=1.1 * heading,
        braking=0.6 * count * astern / mass,
        surge=2.25 * heading,
        heading=heading,
        turn_rate=1.75 * turn,  # more than the boat can, so that a far goal abeam asks for all it has
        yaw=3.5 * heading,
        slowing=4.0,
        sideslip=0.0,
        corner=0.15,
        near=_near(robot),
        least_thrust=0.07 * min(astern, ahead),
        speed_around=0.6,
    )


def _terminal(robot: Robot, axis: int, effort: float) -> float:
    """Speed at which the water's drag equals an effort; infinite without drag [m/s or rad/s].

    Args:
        robot: The boat.
        axis: 0 for the surge, 5 for the yaw.
        effort: Force [N] or moment [N·m].
    """
    water = robot.hydrodynamics
    linear, quadratic = (water.linear_damping[axis], water.quadratic_damping[axis]) if water else (0.0, 0.0)
    if quadratic == 0.0:
        return effort / linear if linear else math.inf
    return (math.sqrt(linear**2 + 4.0 * quadratic * effort) - linear) / (2.0 * quadratic)


def pure_pursuit_gains(robot: Robot) -> PurePursuitGains:
    """Gains of pure pursuit: look as far ahead as the tightest circle is wide, brake as hard as the wheels do."""
    car = robot.actuated_by(Ackermann)
    slew = car.response.slew[:1] or (math.inf,)
    return PurePursuitGains(
        look_ahead=1.4 * car.wheelbase / math.tan(car.max_steering),
        cruise=0.9 * car.max_speed,
        approach=min(FASTEST, 0.22 / _reaction_s(robot)),
        braking=0.9 * min(car.wheel_force / robot.body.mass, car.friction * GRAVITY, *slew),
        sideways=GRIP * car.friction * GRAVITY,
        corner=0.8,
        near=_near(robot),
        velocity=0.1,
        speed_around=0.6,
    )


def _reaction_s(robot: Robot) -> float:
    """From an error to the actuators' answer, slew aside: a control step, delays and the lag [s]."""
    response = robot.actuators.response
    return robot.timing.control_s + response.latest_s + response.lag_s


def _near(robot: Robot) -> float:
    """What counts as there: what noise hides, or a small part of the outline, within what the tasks tolerate [m]."""
    return min(max(6.0 * robot.sensors.odometry.position.std, 0.1 * robot.body.radius), PRECISION)


def rounded(gains: Gains) -> Gains:
    """The same gains with four significant digits, as a file would have them."""
    assert is_dataclass(gains) and not isinstance(gains, type)
    values = {field.name: getattr(gains, field.name) for field in fields(gains)}
    return replace(gains, **{name: _rounded(value) for name, value in values.items()})


def _rounded(value: object) -> object:
    if is_dataclass(value):
        return rounded(value)
    return float(f"{value:.4g}") if isinstance(value, float) else value
