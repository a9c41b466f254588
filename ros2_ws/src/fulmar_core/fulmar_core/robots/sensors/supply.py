"""Gauge of the gas supply: absolute pressure in the tank that feeds the thrusters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.config.plausible_ranges import Plausible
from fulmar_core.robots.sensors.joints import JointSensors, JointSpec
from fulmar_core.robots.sensors.kind import MessageFields, SensorKind, Truth
from fulmar_core.robots.sensors.ranges import size_problem
from fulmar_core.wires.reading import Reading
from fulmar_core.wires.wire import Wire

NAME = "supply"
OVERPRESSURE = 1.5  # pressure that a gauge can report, by that of the full tank [-]
MOST_PA = 1e8  # of a gauge of a robot without a tank in its file: above any bottle of a laboratory [Pa]


@dataclass(frozen=True)
class SupplySpec(JointSpec):
    """What the gauge reports, and when; pressures in Pa."""


class Gauge(JointSensors):
    """The gauge of one simulated robot."""

    name = NAME

    def measure(self, truth: Truth, time_s: float) -> Reading | None:
        """The pressure as a float [Pa] with its variance, (1, 1); None between two measurements or without a tank."""
        true = truth.more.get(NAME)
        if true is None or not self._sampling.is_due(time_s):
            return None
        values, covariance = self.with_errors([true], np.ones(1, dtype=bool))
        return Reading(float(values[0]), covariance=covariance)


def _write(reading: Reading, _spec: SupplySpec) -> list[float]:
    variance = 0.0 if reading.covariance is None else float(reading.covariance[0, 0])  # 0: unknown
    return [float(reading.value), variance]


def _read(values: Sequence[Any]) -> Reading:
    pressure, variance = values
    return Reading(float(pressure), covariance=np.array([[variance]]) if variance > 0.0 else None)


def _problem(reading: Reading, robot: Any) -> str:
    tank = robot.actuators.tank
    most = MOST_PA if tank is None else OVERPRESSURE * tank.pressure
    return size_problem([("the gauge of the supply", reading.value, most)])


KIND = SensorKind(
    spec=SupplySpec,
    wire=Wire(
        "supply/pressure", "sensor_msgs/msg/FluidPressure", "plant", "stream",
        "`rate_hz` of the gauge, else each tick", "absolute pressure in the tank of the thrusters", unit="Pa",
    ),
    frame="base_link",
    message=MessageFields(paths=("fluid_pressure", "variance"), write=_write, read=_read),
    simulate=Gauge,
    problem=_problem,
    numbers=lambda reading, _robot: np.array([reading.value]),
    plausible=(
        Plausible("std", "Pa", (0.0, 1e7), (0.0, 1e6), "gauges: 0.1 to 2 % of 10 to 300 bar"),
        Plausible("rate_hz", "Hz", (0.01, 1e4), (0.2, 1000.0), "pressure transmitters"),
    ),
)  # fmt: skip
