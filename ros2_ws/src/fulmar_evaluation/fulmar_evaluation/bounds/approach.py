"""Bound on the share of time near a goal, for starts at rest some metres away.

Whatever a controller does, its motion along any fixed direction is that of a point whose acceleration is bounded. Along
the line n from start to goal, with the strongest thrust T and the push F from outside, it gains speed with at most
(T + F·n)/m and loses it with at most (T - F·n)/m. Seen along n, the disc around the goal is an interval. The longest
stay in it begins with the fastest way in that still stops at its far end: who enters faster leaves it again for longer
than was won (the entry comes earlier by at most Δv/a, the excursion takes at least 2 sqrt(v1² - v0²)/a).

Left out, always in favour of the machine: that the body must turn to have its strongest direction along the line, that
commands last for a control step, and that it must come to rest across the line as well. Without these, a plan along the
line comes up to the bound within one control step (`tests/fulmar_benchmarks/test_feasibility.py`).
"""

from __future__ import annotations

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.actuators.thrusters import Thrusters
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.episode import Episode
from fulmar_core.states.planar import at_rest
from fulmar_core.worlds.holdability import LEAST_MARGIN, hold_margin
from fulmar_core.worlds.world import World, outside_wrench

# Directions about the line to the goal that are tried; the strictest counts [rad].
DIRECTIONS = np.deg2rad(np.arange(-60.0, 61.0, 5.0))


def approach_bound(
    robot: Robot, drawn: Episode, *, radius: float, steps: int, control_dt: float
) -> np.ndarray:
    """Largest share of an episode's steps that can end within a distance of the goal.

    Args:
        robot: A planar robot with thrusters, on air.
        drawn: Episodes that start at rest.
        radius: What counts as near, > 0 [m].
        steps: Control steps of an episode.
        control_dt: Time of one [s].

    Returns:
        Percentages as in `metrics` (PT5 has a radius of 0.05 m), shape (episodes,) [%].

    Raises:
        ConfigError: The robot is none with thrusters on air.
    """
    if not isinstance(robot.actuators, Thrusters) or robot.hydrodynamics is not None:
        raise ConfigError(f"'{robot.name}' is no body on air with thrusters, which this bound is about.")
    entry = _earliest_entry(robot.actuators, drawn, radius)
    # Simulators move a body by half a physics step more than time allows, in the beginning and at the end.
    entry = np.maximum(entry - robot.timing.physics_dt, 0.0)
    # The state at the end of step k, at k·dt, is what counts.
    before = np.minimum(np.maximum(np.ceil(entry / control_dt - 1e-9) - 1.0, 0.0), steps)
    return np.asarray(100.0 * (steps - before) / steps)


def _earliest_entry(valves: Thrusters, drawn: Episode, radius: float) -> np.ndarray:
    """When the disc is entered if the time in it is to be longest, shape (episodes,); infinite: never [s]."""
    world, goal = drawn.world, np.asarray(drawn.goal.current, dtype=float)
    way = np.stack((goal[:, 0] - drawn.start.x, goal[:, 1] - drawn.start.y), axis=-1)
    distance = np.hypot(way[:, 0], way[:, 1])
    bearing = np.arctan2(way[:, 1], way[:, 0])
    thrust, aid = strongest_thrust(valves, world), _changing_force(world, distance, goal)
    latest = np.zeros(len(distance))
    for direction in DIRECTIONS:
        along = np.stack((np.cos(bearing + direction), np.sin(bearing + direction)), axis=-1)
        force = world.force_x * along[:, 0] + world.force_y * along[:, 1]
        faster = np.maximum(thrust + aid + force, 0.0) / world.mass
        slower = np.maximum(thrust + aid - force, 0.0) / world.mass
        length = np.maximum(distance * np.cos(direction) - radius, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            entry_speed = np.sqrt(2.0 * slower * 2.0 * radius)
            # length = peak²/(2·faster) + (peak² - entry²)/(2·slower), and the last part is 2·radius.
            peak = np.sqrt(2.0 * (length + 2.0 * radius) / (1.0 / faster + 1.0 / slower))
            brakes = peak > entry_speed
            time_s = np.where(
                brakes, peak / faster + (peak - entry_speed) / slower, np.sqrt(2.0 * length / faster)
            )
        time_s = np.where(length > 0.0, np.nan_to_num(time_s, nan=np.inf, posinf=np.inf), 0.0)
        latest = np.maximum(latest, time_s)
    return latest


def strongest_thrust(valves: Thrusters, world: World) -> np.ndarray:
    """Length of the strongest force that the valves of each world can make, shape (worlds,) [N]."""
    working = np.asarray(world.alive * world.gain * (1.0 + world.action_noise), dtype=float)
    forces = valves.thrust * valves.wrench_per_newton[:, :2]
    if valves.shared_pressure:
        return np.asarray(np.max(np.linalg.norm(forces, axis=1)[:, None] * working, axis=0))
    angles = np.deg2rad(np.arange(0.0, 360.0, 1.0))
    along = np.maximum(np.stack((np.cos(angles), np.sin(angles)), axis=-1) @ forces.T, 0.0)
    # Between two of these directions nothing is longer than by half a degree's cosine.
    return np.asarray(np.max(along @ working, axis=0) / np.cos(np.deg2rad(0.5)))


def _changing_force(world: World, distance: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Most that forces which change with place and time can help, either way, shape (episodes,) [N]."""
    reach = np.hypot(goal[:, 0], goal[:, 1]) + 2.0 * distance + np.hypot(world.anchor_x, world.anchor_y)
    line = world.tether_stiffness * (reach + np.hypot(world.tether_x, world.tether_y))
    return np.asarray(np.sqrt(2.0) * world.wave_force + world.kick + line)


def can_hold_episodes(robot: Robot, drawn: Episode) -> np.ndarray:
    """Whether the goal pose of each episode can be held in its own world.

    Args:
        robot: A planar robot with thrusters.
        drawn: Episodes whose goals have a heading, as `draw_episodes` gives them.

    Returns:
        Truth values, shape (episodes,).

    Raises:
        ConfigError: The robot has no thrusters.
    """
    goal = np.asarray(drawn.goal.current, dtype=float)
    there = at_rest(goal[:, 0], goal[:, 1], goal[:, 2])
    # At the beginning nothing kicks; kicks come and go, and no pose is lost for them.
    fx, fy, torque = outside_wrench(there, drawn.world, np.zeros(len(goal)), robot.timing.physics_dt)
    working = (drawn.world.alive * drawn.world.gain).T
    known: dict[bytes, bool] = {}  # most episodes of a condition differ in the lost valves alone
    able = np.zeros(len(goal), dtype=bool)
    for i in range(len(goal)):
        force = np.array([fx[i], fy[i]])
        parts = np.array([*working[i], *force, torque[i], goal[i, 2] if force.any() else 0.0])
        key = parts.tobytes()
        if key not in known:
            known[key] = (
                hold_margin(robot, working[i], force, float(torque[i]), float(goal[i, 2])) > LEAST_MARGIN
            )
        able[i] = known[key]
    return able
