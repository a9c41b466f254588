"""Watches the gas supply of thrusters by its gauge: says in time when it gets low, and when the gauge falls silent."""

from __future__ import annotations

from collections.abc import Mapping

from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.supply import NAME
from fulmar_core.robots.sensors.table import SENSORS
from fulmar_core.wires.reading import Reading

SILENT_S = 5.0  # without a reading until a warning, at least [s]
MISSED = 5.0  # readings that may be missing [-]


class SupplyCheck:
    """Keeps the newest pressure; any thread may read what it says.

    Attributes:
        warning: What is wrong with the supply or its gauge; empty if nothing is.
        pressure: The newest believable one [Pa]; None before the first, and of robots without a gauge.
    """

    def __init__(self, robot: Robot) -> None:
        """Begin without a reading; robots whose file has no gauge say nothing."""
        spec = robot.sensors.specs.get(NAME)
        self._robot, self._watches = robot, spec is not None
        self._silent_after_s = max(SILENT_S, MISSED / spec.rate_hz) if spec and spec.rate_hz else SILENT_S
        self.reset()

    def reset(self) -> None:
        """Begin anew, with an episode."""
        self._silent_s, self._refusal = 0.0, ""
        self.warning = self._low = ""
        self.pressure: float | None = None

    def see(self, seconds: float, readings: Mapping[str, Reading]) -> None:
        """Take how long it was since the last call [s], and the readings at the end."""
        if not self._watches:
            return
        reading = readings.get(NAME)
        refusal = "" if reading is None else SENSORS[NAME].problem(reading, self._robot)
        if reading is None or refusal:
            self._silent_s += seconds
            self._refusal = refusal or self._refusal
        else:
            self._silent_s, self._refusal, self.pressure = 0.0, "", float(reading.value)
            self._low = self._robot.actuators.supply_warning(self.pressure)
        self.warning = self._words()

    def _words(self) -> str:
        if self.pressure is None:  # drivers of devices without a gauge never say one
            return f"the supply pressure is refused: {self._refusal}" if self._refusal else ""
        if self._silent_s > self._silent_after_s:
            why = f": {self._refusal}" if self._refusal else ""
            return f"no supply pressure for {self._silent_s:.0f} s{why}. Is the gauge connected?"
        return self._low
