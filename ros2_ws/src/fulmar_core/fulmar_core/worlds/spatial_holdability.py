"""Holdability in space: whether thrusters or fans can hold a pose, by the linear programme of `holdability.py`."""

from __future__ import annotations

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.states.attitude import even_directions, turn_back
from fulmar_core.worlds.holdability import LEAST_MARGIN, least_margin, one_way_actuators
from fulmar_core.worlds.spatial_world import SpatialWorld

ATTITUDES = 60  # that are tried where any will do


def hold_margin_in_space(
    robot: Robot, working: np.ndarray, force: np.ndarray, torque: np.ndarray, com: np.ndarray
) -> float:
    """How much is left in every direction when a push on a body in space is cancelled.

    Args:
        robot: A robot in space whose actuators push one way.
        working: Share of its thrust that each one gives, 0 for a dead one, shape (n,) [-].
        force: Push from outside on the centre of mass, in the body's frame, shape (3,) [N].
        torque: Same frame, shape (3,) [N·m].
        com: Centre of mass in the body's frame, shape (3,) [m].

    Returns:
        As in `hold_margin`, along the body's three axes and about them.

    Raises:
        ConfigError: The robot's actuators do not push one way.
    """
    valves, can = one_way_actuators(robot), robot.performance
    scale = np.array([can.force] * 3 + [can.torque] * 3)
    wrench = valves.wrench_per_newton.T.copy()
    wrench[3:] -= np.cross(com, wrench[:3].T).T  # about the centre of mass
    wrench = wrench * (valves.full_thrust * np.asarray(working)) / scale[:, None]
    return least_margin(wrench, np.concatenate((force, torque)) / scale, valves.shared_pressure)


def can_hold_in_space(robot: Robot, world: SpatialWorld, quats: np.ndarray | None = None) -> np.ndarray:
    """In which worlds a body in space can hold a pose at all, whatever controls it.

    Constant force and torque, dead and weak actuators and the centre of mass count; kicks, noise and delays pass.

    Args:
        robot: A robot in space whose actuators push one way.
        world: Of `draw_episodes`, say, with arrays of shape (worlds,).
        quats: Attitude (x, y, z, w) of the pose in each world, shape (worlds, 4); None: any will do.

    Returns:
        Shape (worlds,) of bool.

    Raises:
        ConfigError: The robot's actuators do not push one way.
    """
    working = np.asarray(world.gain * world.alive, dtype=float).T
    force, torque, com = (np.asarray(part, dtype=float).T for part in (world.force, world.torque, world.com))
    able = np.zeros(len(working), dtype=bool)
    for i in range(len(able)):
        if quats is None:
            # Only the direction of the force in the body changes with the attitude; as it is first.
            size = float(np.linalg.norm(force[i]))
            tried = [force[i], *(size * even_directions(ATTITUDES))] if size > 0.0 else [force[i]]
        else:
            x, y, z = turn_back(tuple(quats[i]), tuple(force[i]))
            tried = [np.array([x, y, z])]
        able[i] = any(
            hold_margin_in_space(robot, working[i], each, torque[i], com[i]) > LEAST_MARGIN for each in tried
        )
    return able
