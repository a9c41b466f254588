"""Default gains of the laws in space, from mass, inertia, thrust and the command rate.

As `default_gains.py`, in six degrees of freedom: weights of the LQR by Bryson's rule (Bryson and Ho, "Applied Optimal
Control", 1975, §5.2), and a PD law that is critically damped and about as fast. Shares without a unit are our values.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.controllers.space_lqr import SpaceLqrWeights
from fulmar_core.controllers.space_pd import SpacePdGains
from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.robots.robot import Robot
from fulmar_core.states.attitude import even_directions

PRECISION, TURN_PRECISION = 0.05, math.radians(5.0)  # errors at which full thrust is asked for [m], [rad]
# Of the weakest force or torque, with one line that both share, and without; a push may have its part of the rest.
BRAKING_SHARED, BRAKING = 0.35, 0.6
POSITION_LIMIT, ATTITUDE_LIMIT_DEG = 1.0, 45.0
OVERSHOOT = 0.5  # of a waypoint, in errors at which cruising begins
CARRIED = 0.6, 0.48  # of the strongest force and torque of one valve
TRIES = 4096  # directions of the sphere
# Of an open valve, where missing the weakest force costs 1: valves are open a third less, at the price of a millimetre
# and half a degree of error.
LQR_VALVE, PD_VALVE = 0.2, 0.1
TORQUE_ERROR = (
    2.0  # what the PD law pays for a missed torque, in Bryson's: one step of one valve turns a light body far
)


@dataclass(frozen=True)
class _Ability:
    """What valves or fans bring up."""

    force: float  # in the weakest direction [N]
    torque: float  # same [N·m]
    braking: float  # share of these to brake with [-]
    valve: float  # force of the strongest [N]
    valve_torque: float  # torque of the strongest [N·m]
    settling: float  # time in which full thrust crosses `PRECISION` [s]
    turning: float  # same for `TURN_PRECISION` [s]
    mass: float  # [kg]
    inertia: float  # greatest principal moment [kg·m²]


def space_lqr_weights(robot: Robot) -> SpaceLqrWeights:
    """Weights of the LQR for a body in space.

    Raises:
        ValueError: Its actuators do not push in every direction, or do not turn it about every axis.
    """
    can = _ability(robot)
    return SpaceLqrWeights(
        position=1.0 / PRECISION**2,
        attitude=1.0 / TURN_PRECISION**2,
        velocity=(can.settling / PRECISION) ** 2,
        rate=(can.turning / TURN_PRECISION) ** 2,
        force=1.0 / can.force**2,
        torque=1.0 / can.torque**2,
        open_valve=LQR_VALVE,
        **_limits(can),
    )


def space_pd_gains(robot: Robot) -> SpacePdGains:
    """Gains of the PD law for a body in space; see `space_lqr_weights`."""
    can = _ability(robot)
    position, attitude = can.force / PRECISION, can.torque / TURN_PRECISION
    # No faster than what crosses these errors, and that critically damped.
    position = min(position, can.mass * (2.0 / can.settling) ** 2)
    attitude = min(attitude, can.inertia * (1.0 / can.turning) ** 2)
    return SpacePdGains(
        position=position,
        velocity=2.0 * math.sqrt(can.mass * position),
        attitude=attitude,
        rate=2.0 * math.sqrt(can.inertia * attitude),
        force_error=1.0 / can.force**2,
        torque_error=TORQUE_ERROR / can.torque**2,
        open_valve=PD_VALVE,
        **_limits(can),
    )


def _limits(can: _Ability) -> dict[str, float]:
    return {
        "position_error_limit": POSITION_LIMIT,
        "attitude_error_limit_deg": ATTITUDE_LIMIT_DEG,
        "braking_force": can.braking * can.force,
        "braking_torque": can.braking * can.torque,
        "carried_force": CARRIED[0] * can.valve,
        "carried_torque": CARRIED[1] * can.valve_torque,
        "overshoot": OVERSHOOT,
    }


def _ability(robot: Robot) -> _Ability:
    """What a robot can do.

    Raises:
        ValueError: Its actuators do not push in every direction, or do not turn it about every axis.
    """
    actuators, step = robot.actuated_by(Pushing), robot.timing.control_s
    full = actuators.full_thrust[:, None] * actuators.wrench_per_newton
    force, torque = (weakest(part, shared=actuators.shared_pressure) for part in (full[:, :3], full[:, 3:]))
    strongest = float(actuators.full_thrust.max())
    if force < 1e-3 * strongest or torque < 1e-3 * strongest * robot.body.radius:
        raise ValueError(
            f"the {actuators.kind} do not push in every direction and turn the body about every axis."
        )
    mass, inertia = robot.body.mass, float(np.linalg.eigvalsh(robot.body.inertia_matrix)[-1])
    return _Ability(
        force,
        torque,
        braking=BRAKING_SHARED if actuators.shared_pressure else BRAKING,
        valve=strongest,
        valve_torque=float(np.linalg.norm(full[:, 3:], axis=1).max()),
        settling=max(3.0 * step, math.sqrt(2.0 * PRECISION * mass / force)),
        turning=max(2.5 * step, math.sqrt(2.0 * TURN_PRECISION * inertia / torque)),
        mass=mass,
        inertia=inertia,
    )


def weakest(full: np.ndarray, *, shared: bool) -> float:
    """Largest force or torque that is there in every direction.

    Args:
        full: Of each actuator at full command, shape (n, 3).
        shared: They share one supply.
    """
    along = np.maximum(even_directions(TRIES) @ full.T, 0.0)
    return float((along.max(axis=1) if shared else along.sum(axis=1)).min())
