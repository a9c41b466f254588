"""The table of sensors: a row makes a sensor known to robots, simulators, drivers, nodes and bags."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from fulmar_core.config.plausible_ranges import Plausible
from fulmar_core.robots.sensors import air_data, fuel, imu, odometer, star_tracker, supply, surfaces, wheels
from fulmar_core.robots.sensors.kind import SensorKind
from fulmar_core.robots.sensors.own_sensor import OwnSensorSpec, own_sensor_kind

# By the name in a robot's YAML, in the order in which a plant publishes: controllers wait for the odometry.
SENSORS: dict[str, SensorKind] = {
    "odometry": odometer.KIND,
    "imu": imu.KIND,
    "star_tracker": star_tracker.KIND,
    "wheels": wheels.KIND,
    "air_data": air_data.KIND,
    "surfaces": surfaces.KIND,
    "supply": supply.KIND,
    "fuel": fuel.KIND,
}

RANGES: tuple[Plausible, ...] = tuple(
    replace(row, key=f"sensors.{name}.{row.key}") for name, kind in SENSORS.items() for row in kind.plausible
)


def sensor_kind(name: str, spec: Any) -> SensorKind:
    """The row of a sensor of some robot, by its name and what the robot's file says of it.

    Raises:
        ConfigError: It is a user's own, whose class cannot be loaded.
    """
    return own_sensor_kind(name, spec) if isinstance(spec, OwnSensorSpec) else SENSORS[name]
