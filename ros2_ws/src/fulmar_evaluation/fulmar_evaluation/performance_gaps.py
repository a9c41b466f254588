"""Numbers of `performance` in a robot's file beside what its actuators give, and a hull's speed beside its drag."""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt

import numpy as np

from fulmar_core.robots.hydrodynamics import Hydrodynamics
from fulmar_core.robots.robot import Robot
from fulmar_evaluation.wrench_limits import WrenchSet

# Between `performance` and what the actuators give: beyond the first a warning, beyond the second a mistake of unit.
USUAL_GAP, LARGEST_GAP = 2.0, 5.0


def performance_gaps(robot: Robot, wrenches: WrenchSet) -> Iterator[tuple[float, str]]:
    """How many times numbers of `performance` differ from what the actuators give [-], each with a line."""
    yield from _gaps(robot, wrenches)
    yield from _water_gaps(robot, wrenches)


def _gaps(robot: Robot, wrenches: WrenchSet) -> Iterator[tuple[float, str]]:
    """How many times numbers of `performance` differ from what the actuators give, with a line."""
    force, torque = most_in_plane(wrenches)
    given = [
        ("force", "N", robot.performance.force, force),
        ("torque", "N·m", robot.performance.torque, torque),
    ]
    for name, unit, wanted, found in given:
        if found < 1e-9:  # none at all: that is a matter of rank
            continue
        gap = max(wanted / found, found / wanted)
        if gap > USUAL_GAP:
            yield (
                gap,
                f"'performance.{name}' = {wanted:g} {unit}, and its actuators give {found:.4g} {unit} at most in the "
                f"plane of x and y; accepted is {found / LARGEST_GAP:.4g} to {found * LARGEST_GAP:.4g} {unit}. Correct "
                "whichever is wrong; units are N and N·m.",
            )


def _water_gaps(robot: Robot, wrenches: WrenchSet) -> Iterator[tuple[float, str]]:
    """Same of a hull's top speed, as gaps of the force: where the most that pushes ahead is what the water takes."""
    water = robot.hydrodynamics
    if water is None or "force_x" not in wrenches.axes:
        return
    push = float(wrenches.limits[wrenches.axes.index("force_x")][1])
    linear, quadratic, wanted = (
        water.linear_damping[0],
        water.quadratic_damping[0],
        robot.performance.top_speed,
    )
    taken = wanted * (linear + quadratic * wanted)
    if push < 1e-9 or taken < 1e-9:
        return
    gap = max(push / taken, taken / push)
    if gap > USUAL_GAP:
        fastest = fastest_in_water(water, push)
        yield (
            gap,
            f"'performance.top_speed' = {wanted:g} m/s, where 'hydrodynamics' takes {taken:.4g} N; its actuators push "
            f"by {push:.4g} N, good for {fastest:.4g} m/s. Correct whichever is wrong: linear_damping and "
            "quadratic_damping are in N per m/s and N per (m/s)².",
        )


def most_in_plane(wrenches: WrenchSet) -> tuple[float, float]:
    """Largest force along x and y in any direction [N], and largest torque about z [N·m]; 0 where there is none."""
    angles = np.arange(32) * 2.0 * np.pi / 32
    forces = [i for i, axis in enumerate(wrenches.axes) if axis in ("force_x", "force_y")]
    force = torque = 0.0
    if forces:
        directions = np.zeros((len(angles), len(wrenches.axes)))
        directions[:, forces] = np.stack((np.cos(angles), np.sin(angles)), axis=-1) * wrenches.scale[0]
        free = [i for i in range(len(wrenches.axes)) if i not in forces]
        force = max(wrenches.most_along(way, free=free) for way in directions) * float(wrenches.scale[0])
    yaw = wrenches.axes.index("torque_z")
    if wrenches.columns[yaw].any():
        way = np.zeros(len(wrenches.axes))
        way[yaw] = wrenches.scale[yaw]
        others = [i for i in range(len(wrenches.axes)) if i != yaw]
        most = max(wrenches.most_along(sign * way, free=others) for sign in (1.0, -1.0))
        torque = most * float(wrenches.scale[yaw])
    return force, torque


def fastest_in_water(water: Hydrodynamics, push: float) -> float:
    """Speed at which the drag of surge is a push ahead [N], both dampings not 0 [m/s]."""
    linear, quadratic = water.linear_damping[0], water.quadratic_damping[0]
    return 2.0 * push / (linear + sqrt(linear**2 + 4.0 * quadratic * push))
