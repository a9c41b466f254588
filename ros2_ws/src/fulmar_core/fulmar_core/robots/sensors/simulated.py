"""The sensors of one simulated robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fulmar_core.robots.sensors.kind import SimulatedSensor, Truth
from fulmar_core.robots.sensors.table import sensor_kind
from fulmar_core.wires.reading import Reading


class SimulatedSensors:
    """Every sensor of a robot that is simulated from the true motion: all but the odometry."""

    def __init__(self, specs: Mapping[str, Any], *, noisy: bool) -> None:
        """Build them.

        Args:
            specs: The robot's sensors by name, as `Sensors.specs`.
            noisy: False: without errors and at once, each at its own rate.
        """
        self._sensors: dict[str, SimulatedSensor] = {}
        for name, spec in specs.items():
            simulate = sensor_kind(name, spec).simulate
            if simulate is not None:
                self._sensors[name] = simulate(spec, noisy)

    def reset(self, seed: int, number: int) -> None:
        """Begin episode `number` of a seed."""
        for sensor in self._sensors.values():
            sensor.reset(seed, number)

    def measure(self, truth: Truth, time_s: float) -> dict[str, Reading]:
        """New readings by name; arguments as in `SimulatedSensor.measure`."""
        found = {name: sensor.measure(truth, time_s) for name, sensor in self._sensors.items()}
        return {name: reading for name, reading in found.items() if reading is not None}
