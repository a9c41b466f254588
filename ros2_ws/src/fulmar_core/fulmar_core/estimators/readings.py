"""The table of readings: what estimators and controllers may take beside the odometry, by name.

Readings are checked against what a robot's devices can report before anything takes them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.estimators.images import IMAGE_LASTS_S, color_problem, depth_problem
from fulmar_core.estimators.inertia.momentum_balance import is_body
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.kind import SensorKind
from fulmar_core.robots.sensors.ranges import attitude_problem, covariance_problem, size_problem
from fulmar_core.robots.sensors.table import SENSORS
from fulmar_core.robots.topics import (
    CAMERA_DEPTH,
    CAMERA_IMAGE,
    EVENTS,
    EVENTS_2,
    INERTIA,
    MOCAP,
    ODOMETRY,
    RATE,
)
from fulmar_core.wires.reading import Reading
from fulmar_core.wires.wire import Wire

FARTHEST_M = 1e5  # of a pose from the origin of its motion capture: no hall and no lake is larger [m]
# Of a body by that of its file: tanks that run dry and panels that unfold change it by less [-].
MOST_INERTIA = 5.0


@dataclass(frozen=True)
class ReadingKind:
    """One row: where a reading comes in, and what may be said with it."""

    wire: Wire
    problem: Callable[[Reading, Robot], str]  # why it cannot come from a device of the robot; empty if it can
    sensor: SensorKind | None = None  # whose it is; None: of another node
    lasts_s: float = 1.0  # older ones are not used by controllers [s]
    per_robot: bool = True  # whether a controller gets it with a leading axis of robots
    # Whether it is an image of the robot's camera: in lock step a step waits for that of its own time, and a controller
    # that takes it does not act without it.
    image: bool = False

    @property
    def comes_with_its_step(self) -> bool:
        """Whether in lock step the reading of a time counts from the step of that time on."""
        return self.sensor is not None or self.image

    def numbers(self, reading: Reading, robot: Robot) -> np.ndarray:
        """What a controller gets of it; see `Inputs.readings`."""
        if self.image:
            return np.asarray(reading.value)
        if self.sensor is None:
            return np.asarray(reading.value, dtype=float)
        return self.sensor.numbers(reading, robot)


def readings_of(robot: Robot) -> dict[str, ReadingKind]:
    """What can be read of a robot, by name; sensors of the table that it lacks are there, too, and say nothing.

    Raises:
        ConfigError: A sensor of the user's own cannot be loaded, or has the name of another reading.
    """
    for name in robot.sensors.own.keys() & OTHERS.keys():
        raise ConfigError(f"sensor '{name}' of '{robot.name}': another reading has that name. Rename it.")
    kinds = robot.sensors.kinds if robot.sensors.own else {}
    return READINGS | {name: _of_sensor(kinds[name]) for name in robot.sensors.own}


def reading_problem(name: str, reading: Reading, robot: Robot) -> str:
    """Why a reading cannot come from a device of a robot; empty if it can.

    Args:
        name: Of the reading, as the row of an estimator lists it.
        reading: With its stamp.
        robot: Its file says what its devices can report.
    """
    if name in robot.sensors.own:
        return robot.sensors.kinds[name].problem(reading, robot)
    return READINGS[name].problem(reading, robot) if name in READINGS else ""


def _of_sensor(kind: SensorKind) -> ReadingKind:
    return ReadingKind(kind.wire, kind.problem, kind)


def _pose(reading: Reading, _robot: Robot) -> str:
    place = np.asarray(reading.value[:3], dtype=float)
    problem = size_problem(("the place of the pose", each, FARTHEST_M) for each in place.tolist())
    return problem or _named("the pose is refused", attitude_problem(reading.value[3:]))


def _rate(reading: Reading, robot: Robot) -> str:
    rates = np.asarray(reading.value, dtype=float).tolist()
    problem = size_problem(("the turn rate", each, 2.0 * robot.limits.yaw_rate) for each in rates)
    return problem or _named("the turn rate is refused", covariance_problem(reading.covariance))


def _inertia(reading: Reading, robot: Robot) -> str:
    """Why an estimate is the inertia of no body that is built as the robot's file says."""
    tensor = reading.value
    if not np.isfinite(tensor).all() or not is_body(tensor):
        return "the inertia on the wire is that of no body"
    shares = np.linalg.eigvalsh(tensor) / np.linalg.eigvalsh(robot.body.inertia_matrix)
    if shares.min() < 1.0 / MOST_INERTIA or shares.max() > MOST_INERTIA:
        return f"the inertia on the wire differs from that of the robot's file by a factor of over {MOST_INERTIA:g}"
    return ""


def _named(what: str, problem: str) -> str:
    return problem and f"{what}: {problem}"


def _unchecked(_reading: Reading, _robot: Robot) -> str:
    """Packets of events are checked by their estimator, which knows the cameras."""
    return ""


OTHERS: dict[str, ReadingKind] = {
    "mocap": ReadingKind(MOCAP, _pose),
    "rate": ReadingKind(RATE, _rate),
    # An estimate that is not repeated for 10 s was withdrawn.
    "inertia": ReadingKind(INERTIA, _inertia, lasts_s=10.0, per_robot=False),
    "events": ReadingKind(EVENTS, _unchecked),
    "events_2": ReadingKind(EVENTS_2, _unchecked),
    "camera_depth": ReadingKind(CAMERA_DEPTH, depth_problem, lasts_s=IMAGE_LASTS_S, image=True),
    "camera_image": ReadingKind(CAMERA_IMAGE, color_problem, lasts_s=IMAGE_LASTS_S, image=True),
}
READINGS: dict[str, ReadingKind] = OTHERS | {
    name: _of_sensor(kind) for name, kind in SENSORS.items() if kind.wire != ODOMETRY
}
