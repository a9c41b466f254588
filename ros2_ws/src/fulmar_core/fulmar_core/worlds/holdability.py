"""Holdability: whether a pose can be held, by a linear programme over the share of time that each valve is open.

Over many control steps, valves that open and close give any mean wrench that shares of time can make: shares d_i >= 0,
with a common pressure line Σ d_i <= 1, since n open valves give 1/n each. A pose can be held where the mean wrench
cancels the push from outside with something left in every direction: without that, an error once made stays.
"""

from __future__ import annotations

import functools
import itertools

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.actuators.pushing import PLANAR, Pushing
from fulmar_core.robots.robot import Robot
from fulmar_core.states.planar import to_body

LEAST_MARGIN = 1e-6  # of the robot's own force and torque: rounding of the solver lies below [-]
HEADINGS = 72  # that are tried where any will do


def hold_margin(robot: Robot, working: np.ndarray, force: np.ndarray, torque: float, heading: float) -> float:
    """How much is left in every direction when the push is cancelled.

    Args:
        robot: A planar robot with thrusters.
        working: Share of its thrust that each valve gives, shape (n,) [-].
        force: Push from outside along the world's x and y, shape (2,) [N].
        torque: Same [N·m].
        heading: Of the body [rad].

    Returns:
        The largest share of the robot's own force (`performance`) along either body axis, and of its own torque, either
        way, that can be made on top of what cancels the push; negative where that is too strong [-].

    Raises:
        ConfigError: The robot has no thrusters.
    """
    valves = one_way_actuators(robot)
    scale = np.array([robot.performance.force, robot.performance.force, robot.performance.torque])
    wrench = (
        valves.full_thrust[:, None]
        * valves.wrench_per_newton[:, PLANAR]
        * np.asarray(working)[:, None]
        / scale
    ).T
    push = np.array([*to_body(np.asarray(heading), force[0], force[1]), torque]) / scale
    return least_margin(wrench, push, valves.shared_pressure)


def least_margin(wrench: np.ndarray, push: np.ndarray, shared_pressure: bool) -> float:
    """Largest part of every axis, either way, that can be made on top of what cancels a push.

    Args:
        wrench: Of each actuator at full command, shape (axes, n) [-].
        push: From outside, in the same shares, shape (axes,) [-].
        shared_pressure: Whether shares of time add up to 1 at most.
    """
    # At import this would cost every node most of a second.
    from scipy.optimize import linprog

    axes, count = wrench.shape
    ways = np.vstack((np.eye(axes), -np.eye(axes)))
    # One set of shares for each of the ways, and one margin for all: W d_k - margin·way_k = -push.
    equal = np.zeros((axes * len(ways), len(ways) * count + 1))
    for k, way in enumerate(ways):
        rows = slice(axes * k, axes * (k + 1))
        equal[rows, k * count : (k + 1) * count] = wrench
        equal[rows, -1] = -way
    at_most = np.hstack((np.kron(np.eye(len(ways)), np.ones((1, count))), np.zeros((len(ways), 1))))
    goal = np.zeros(len(ways) * count + 1)
    goal[-1] = -1.0
    found = linprog(
        goal,
        A_ub=at_most if shared_pressure else None,
        b_ub=np.ones(len(ways)) if shared_pressure else None,
        A_eq=equal,
        b_eq=np.tile(-push, len(ways)),
        bounds=[(0.0, 1.0)] * (len(ways) * count) + [(None, None)],
    )
    return float(found.x[-1]) if found.x is not None else -np.inf


def can_hold(
    robot: Robot,
    lost: tuple[int, ...] = (),
    force: tuple[float, float] = (0.0, 0.0),
    torque: float = 0.0,
    heading: float | None = None,
) -> bool:
    """Whether a pose can be held without some thrusters.

    Args:
        robot: A planar robot with thrusters.
        lost: Numbers of those that stay closed, from 0.
        force: Push from outside along the world's x and y [N].
        torque: Same [N·m].
        heading: Of the pose; None: any will do [rad].

    Raises:
        ConfigError: The robot has no thrusters.
    """
    working = np.ones(len(one_way_actuators(robot).names))
    working[list(lost)] = 0.0
    push = np.asarray(force, dtype=float)
    # Without a force from outside every heading is alike.
    headings = HEADINGS if np.any(push) else 1
    tried = np.arange(headings) * 2.0 * np.pi / headings if heading is None else np.array([heading])
    return any(hold_margin(robot, working, push, torque, float(yaw)) > LEAST_MARGIN for yaw in tried)


@functools.lru_cache(maxsize=16)
def uncontrollable_losses(robot: Robot, count: int) -> tuple[tuple[int, ...], ...]:
    """Numbers, from 0, of thrusters that leave no pose to hold when `count` of them are lost together, without a push.

    A robot without thrusters has none.
    """
    if not robot.actuators.one_way:
        return ()
    every = itertools.combinations(range(len(robot.actuators.names)), count)
    return tuple(lost for lost in every if not can_hold(robot, lost))


def one_way_actuators(robot: Robot) -> Pushing:
    """The robot's thrusters or fans.

    Raises:
        ConfigError: It has none.
    """
    if not robot.actuators.one_way:
        raise ConfigError(f"'{robot.name}' has no thrusters, so that there are no shares of time to choose.")
    return robot.actuated_by(Pushing)
