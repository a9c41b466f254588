"""How fast a body that floats slows down at worst, in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.space_gains import weakest
from fulmar_core.robots.actuators.force_authority import ForceAuthority
from fulmar_core.robots.actuators.pushing import OneWay, Pushing
from fulmar_core.robots.known_delay import known_delay_s
from fulmar_core.robots.robot import Robot

YAW = 5  # of a wrench in space
# A command is fixed in the body's frame for a whole step; a body that turns further meanwhile is not pushed where its
# controller means it to be.
TURN_PER_STEP = 0.48  # [rad]
SLOWED_S = 1.65  # in which full torque slows the fastest turn to a calm one [s]
CALM = 0.5  # turn rate at which a body brakes as if it did not turn [rad/s]
SPEED_SHARE, RATE_SHARE = (
    0.8,
    0.8,
)  # of the limits, beyond which odometry is rejected and no guard acts any more


@dataclass(frozen=True)
class Beliefs:
    """How far the body may differ from its file before the guard's sums are wrong: one that was identified."""

    mass: float = 1.05  # largest, over the nominal one [-]
    inertia: float = 1.18  # same [-]
    thrust: float = 0.9  # smallest, over the nominal one [-]
    push: float = 0.1  # largest force from outside, as a share of the robot's own [-]
    torque: float = 0.05  # same [-]
    delay_s: float = 0.06  # largest of commands, beyond what the robot's file says [s]


IDENTIFIED = Beliefs()


@dataclass(frozen=True)
class Braking:
    """What follows from the beliefs; see `braking_of`."""

    deceleration: float  # along any direction, at worst [m/s²]
    turning: float  # deceleration of a turn about any axis, at worst [rad/s²]
    pushed: float  # acceleration by what pushes from outside, at worst [m/s²]
    late_s: float  # until a command acts, at worst [s]
    turn_rate: float  # the fastest that the guard lets the body turn [rad/s]
    speed: float  # the fastest that it lets the body fly [m/s]

    def slowing_s(self, rate: np.ndarray) -> np.ndarray:
        """Time until a body that turns brakes with all it has; turn rates of any shape [rad/s]."""
        return 0.7 * np.maximum(rate - CALM, 0.0) / self.turning


def floats(robot: Robot) -> bool:
    """Whether a robot keeps its motion when its actuators rest, and these push it: on air, and in space."""
    return robot.drifts and isinstance(robot.actuators, OneWay)


def braking_of(robot: Robot, beliefs: Beliefs, dt: float) -> Braking:
    """Find out how well a robot brakes.

    Args:
        robot: One that floats.
        beliefs: How far it may differ from its file.
        dt: Time of a control step [s].

    Raises:
        ConfigError: What pushes from outside may be stronger than its actuators in some direction.
    """
    actuators, body = robot.actuated_by(Pushing), robot.body
    force, torque = _weakest(actuators, plane=robot.state_type.AXES == 2)
    inertia = beliefs.inertia * float(np.linalg.eigvalsh(body.inertia_matrix)[-1])
    if robot.state_type.AXES == 2:
        inertia = beliefs.inertia * body.inertia[2]
    can = robot.performance
    pushed, twisted = beliefs.push * can.force, beliefs.torque * can.torque
    left, turning = beliefs.thrust * force - pushed, beliefs.thrust * torque - twisted
    if left <= 0.0 or turning <= 0.0:
        raise ConfigError(
            f"the actuators of '{robot.name}' have {force:.3g} N and {torque:.3g} N·m in their weakest direction, too "
            f"little to stop it against {pushed:.3g} N and {twisted:.3g} N·m from "
            "outside. Run it without --area and without --guard."
        )
    alpha = turning / inertia
    return Braking(
        deceleration=left / (beliefs.mass * body.mass),
        turning=alpha,
        pushed=pushed / body.mass,
        late_s=known_delay_s(robot) + beliefs.delay_s,
        turn_rate=min(TURN_PER_STEP / dt, CALM + SLOWED_S * alpha, RATE_SHARE * robot.limits.yaw_rate),
        speed=SPEED_SHARE * robot.limits.speed,
    )


def _weakest(actuators: Pushing, *, plane: bool) -> tuple[float, float]:
    """Force and torque that the actuators have in every direction [N, N·m]."""
    full, shared = actuators.full_thrust[:, None] * actuators.wrench_per_newton, actuators.shared_pressure
    if not plane:
        return weakest(full[:, :3], shared=shared), weakest(full[:, 3:], shared=shared)
    ways = np.maximum(np.outer((1.0, -1.0), full[:, YAW]), 0.0)
    torque = float((ways.max(axis=1) if shared else ways.sum(axis=1)).min())
    return ForceAuthority(actuators).at_least, torque
