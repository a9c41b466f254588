"""Tachometers of reaction wheels: speed of each wheel relative to the body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.config.plausible_ranges import Plausible
from fulmar_core.robots.sensors.joints import JointSensors, JointSpec
from fulmar_core.robots.sensors.kind import MessageFields, SensorKind, Truth
from fulmar_core.robots.sensors.ranges import in_order, named_problem
from fulmar_core.wires.reading import Reading
from fulmar_core.wires.wire import Wire

NAME = "wheels"
OVERSPEED = 1.2  # speed that a tachometer can report, by the top speed of the robot's file [-]


@dataclass(frozen=True)
class WheelsSpec(JointSpec):
    """What the tachometers report, and when; speeds in rad/s."""


@dataclass(frozen=True, slots=True)
class WheelSpeeds:
    """Speeds of the wheels of one robot relative to its body."""

    names: tuple[str, ...]  # of the wheels
    speeds: np.ndarray  # shape (n,) [rad/s]


class Tachometers(JointSensors):
    """The tachometers of one simulated robot."""

    name = NAME

    def measure(self, truth: Truth, time_s: float) -> Reading | None:
        """`WheelSpeeds`, with their covariance of shape (n, n); None between two measurements or without wheels."""
        true = truth.more.get(NAME)
        if true is None or not self._sampling.is_due(time_s):
            return None
        speeds, covariance = self.with_errors(true.speeds, np.ones(len(true.names), dtype=bool))
        return Reading(WheelSpeeds(true.names, speeds), covariance=covariance)


def _write(reading: Reading, _spec: WheelsSpec) -> list[Any]:
    return [list(reading.value.names), reading.value.speeds.tolist()]


def _read(values: Sequence[Any]) -> Reading:
    names, speeds = values
    return Reading(WheelSpeeds(tuple(names), np.array(speeds, dtype=float)))


def _problem(reading: Reading, robot: Any) -> str:
    spec = robot.sensors.specs.get(NAME, WheelsSpec())
    most = OVERSPEED * robot.actuators.top_speed + 5.0 * spec.std
    ranges = dict.fromkeys(robot.actuators.wheel_names, most)
    return named_problem("wheel", reading.value.names, reading.value.speeds, ranges)


KIND = SensorKind(
    spec=WheelsSpec,
    wire=Wire(
        "wheels/state", "sensor_msgs/msg/JointState", "plant", "stream", "`rate_hz` of the tachometers, else each tick",
        "speed of each reaction wheel relative to the body; `velocity` by wheel name", unit="rad/s",
    ),
    frame="base_link",
    message=MessageFields(paths=("name", "velocity"), write=_write, read=_read),
    simulate=Tachometers,
    problem=_problem,
    numbers=lambda reading, robot: in_order(reading.value.names, reading.value.speeds, robot.actuators.wheel_names),
    plausible=(
        Plausible("std", "rad/s", (0.0, 100.0), (0.0, 2.0), "tachometers: a thousandth of the speed"),
        Plausible("rate_hz", "Hz", (0.05, 1e4), (0.5, 1000.0), "wheel electronics"),
    ),
)  # fmt: skip
