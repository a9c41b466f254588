"""Sensors of an aircraft's servos and motors: where each surface stands, and how far each motor is open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.config.plausible_ranges import Plausible
from fulmar_core.robots.actuators.control_surfaces import is_throttle
from fulmar_core.robots.sensors.joints import JointSensors, JointSpec
from fulmar_core.robots.sensors.kind import MessageFields, SensorKind, Truth
from fulmar_core.robots.sensors.ranges import in_order, named_problem
from fulmar_core.wires.reading import Reading
from fulmar_core.wires.wire import Wire

NAME = "surfaces"
OVERTRAVEL = 1.5  # position that a servo can report, by the limit of the robot's file [-]


@dataclass(frozen=True)
class SurfacesSpec(JointSpec):
    """What the servos report, and when; deflections in rad. Levels of motors are reported without errors."""


@dataclass(frozen=True, slots=True)
class SurfacePositions:
    """Where the surfaces and motors of one aircraft stand."""

    names: tuple[str, ...]  # of the actuators: surfaces, then throttles
    positions: np.ndarray  # shape (n,): deflections [rad], then thrust levels from 0 to 1


class ServoSensors(JointSensors):
    """The sensors of one simulated aircraft."""

    name = NAME

    def measure(self, truth: Truth, time_s: float) -> Reading | None:
        """`SurfacePositions`, with their covariance (n, n); None between two measurements or of other robots."""
        true = truth.more.get(NAME)
        if true is None or not self._sampling.is_due(time_s):
            return None
        turned = np.array([not is_throttle(name) for name in true.names])
        positions, covariance = self.with_errors(true.positions, turned)
        return Reading(SurfacePositions(true.names, positions), covariance=covariance)


def _write(reading: Reading, _spec: SurfacesSpec) -> list[Any]:
    return [list(reading.value.names), reading.value.positions.tolist()]


def _read(values: Sequence[Any]) -> Reading:
    names, positions = values
    return Reading(SurfacePositions(tuple(names), np.array(positions, dtype=float)))


def _problem(reading: Reading, robot: Any) -> str:
    names, most = robot.actuators.names, robot.actuators.scale
    ranges = {name: OVERTRAVEL * float(each) for name, each in zip(names, most, strict=True)}
    return named_problem("actuator", reading.value.names, reading.value.positions, ranges)


KIND = SensorKind(
    spec=SurfacesSpec,
    wire=Wire(
        "surfaces/state", "sensor_msgs/msg/JointState", "plant", "stream", "`rate_hz` of the servos, else each tick",
        "measured deflection of each surface and level of each throttle of an aircraft; `position` by actuator name",
        unit="rad, 0 to 1",
    ),
    frame="base_link",
    message=MessageFields(paths=("name", "position"), write=_write, read=_read),
    simulate=ServoSensors,
    problem=_problem,
    numbers=lambda reading, robot: in_order(reading.value.names, reading.value.positions, robot.actuators.names),
    plausible=(
        Plausible("std", "rad", (0.0, 0.5), (0.0, 0.05), "potentiometers of servos"),
        Plausible("quantum", "rad", (0.0, 0.2), (0.0, 0.02), "magnetic encoders: 12 bit a turn"),
        Plausible("rate_hz", "Hz", (0.05, 1e4), (0.5, 1000.0), "servo electronics"),
    ),
)  # fmt: skip
