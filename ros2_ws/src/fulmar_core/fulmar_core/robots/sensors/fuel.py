"""Gauge of the fuel: mass of what is left in the tank of the thrusters, and its share of the full one."""

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

NAME = "fuel"
NAMES = ("mass", "share")  # [kg], and of the full tank [-]
MOST = {"mass": 1e4, "share": 2.0}  # of a gauge of a robot without a tank in its file [kg], [-]
MORE = 1.5  # that a gauge can report, by what is in the full tank [-]


@dataclass(frozen=True)
class FuelSpec(JointSpec):
    """What the gauge reports, and when; masses in kg."""

    observed: bool = False  # what policies observe ends with the share that is left


@dataclass(frozen=True, slots=True)
class Fuel:
    """What is left in one tank."""

    names: tuple[str, ...]  # of `NAMES`
    values: np.ndarray  # shape (n,) [kg], [-]


def fuel_of(mass: float, content: float) -> Fuel:
    """What is left of a full tank's content [kg]."""
    return Fuel(NAMES, np.array([mass, mass / content]))


class FuelGauge(JointSensors):
    """The gauge of one simulated robot."""

    name = NAME

    def measure(self, truth: Truth, time_s: float) -> Reading | None:
        """`Fuel` with its covariance, (2, 2); None between two measurements or without a tank."""
        true = truth.more.get(NAME)
        if true is None or not self._sampling.is_due(time_s):
            return None
        mass, share = true.values.tolist()
        values, spread = self.with_errors([mass], np.ones(1, dtype=bool))
        by = np.array([1.0, share / mass if mass > 0.0 else 0.0])  # the share goes with the mass
        return Reading(Fuel(NAMES, values[0] * by), covariance=spread[0, 0] * np.outer(by, by))


def _write(reading: Reading, _spec: FuelSpec) -> list[Any]:
    return [list(reading.value.names), reading.value.values.tolist()]


def _read(values: Sequence[Any]) -> Reading:
    names, numbers = values
    return Reading(Fuel(tuple(names), np.array(numbers, dtype=float)))


def _problem(reading: Reading, robot: Any) -> str:
    tank = robot.actuators.tank
    most = MOST if tank is None else {"mass": MORE * tank.content, "share": MORE}
    return named_problem("fuel gauge's", reading.value.names, reading.value.values, most)


KIND = SensorKind(
    spec=FuelSpec,
    wire=Wire(
        "supply/fuel", "sensor_msgs/msg/JointState", "plant", "stream", "`rate_hz` of the gauge, else each tick",
        "`mass` of what is left in the tank of the thrusters, and its `share` of the full one, in `position` by name",
        unit="kg, -",
    ),
    frame="base_link",
    message=MessageFields(paths=("name", "position"), write=_write, read=_read),
    simulate=FuelGauge,
    problem=_problem,
    numbers=lambda reading, _robot: in_order(reading.value.names, reading.value.values, NAMES),
    plausible=(
        Plausible("std", "kg", (0.0, 1e3), (0.0, 100.0), "gauges by pressure and temperature: about 1 % of the fuel"),
        Plausible("rate_hz", "Hz", (0.01, 1e4), (0.2, 1000.0), "pressure transmitters"),
    ),
)  # fmt: skip
