"""Checks readings against what a robot's devices can report, before an estimator takes them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.ranges import attitude_problem, covariance_problem, size_problem
from fulmar_core.robots.sensors.table import SENSORS
from fulmar_core.wires.reading import Reading

FARTHEST_M = 1e5  # of a pose from the origin of its motion capture: no hall and no lake is larger [m]

Check = Callable[[Reading, Robot], str]


def reading_problem(name: str, reading: Reading, robot: Robot) -> str:
    """Why a reading cannot come from a device of a robot; empty if it can.

    Args:
        name: Of the reading, as the row of an estimator lists it.
        reading: With its stamp.
        robot: Its file says what its devices can report.
    """
    check = CHECKS.get(name)
    return check(reading, robot) if check is not None else ""


def _pose(reading: Reading, _robot: Robot) -> str:
    place = np.asarray(reading.value[:3], dtype=float)
    problem = size_problem(("the place of the pose", each, FARTHEST_M) for each in place.tolist())
    return problem or _named("the pose is refused", attitude_problem(reading.value[3:]))


def _rate(reading: Reading, robot: Robot) -> str:
    rates = np.asarray(reading.value, dtype=float).tolist()
    problem = size_problem(("the turn rate", each, 2.0 * robot.limits.yaw_rate) for each in rates)
    return problem or _named("the turn rate is refused", covariance_problem(reading.covariance))


def _named(what: str, problem: str) -> str:
    return problem and f"{what}: {problem}"


# Packets of events are checked by their estimator, which knows the cameras.
CHECKS: dict[str, Check] = {
    **{name: kind.problem for name, kind in SENSORS.items()},
    "mocap": _pose,
    "rate": _rate,
}
