"""Watches the gas supply of thrusters by its gauge: says when it gets low or is empty, and when the gauge is silent."""

from __future__ import annotations

import math
from collections.abc import Mapping

from fulmar_core.estimators.actuator_health.failed_part import Finding
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.supply import NAME
from fulmar_core.robots.sensors.table import SENSORS
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.reading import Reading

SILENT_S = 5.0  # without a reading until a warning, at least [s]
MISSED = 5.0  # readings that may be missing [-]
MEAN_S = 2.0  # over which readings are averaged before a tank is empty: gauges of full tanks are coarse at the end [s]
EMPTY = "the tank is empty: no thrust any more"
TANK_EMPTY = "tank_empty"  # key of a health status under which a plant says so


class SupplyCheck:
    """Keeps the newest pressure; any thread may read what it says.

    Attributes:
        warning: What is wrong with the supply or its gauge; empty if nothing is.
        pressure: The newest believable one [Pa]; None before the first, and of robots without a gauge.
        empty: That no thrust is left, and how the robot moves on; None until then, and then to the end of the episode.
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
        self.empty: Finding | None = None
        self._mean, self._seen_s = 0.0, 0.0  # of the pressure [Pa], and since its first reading [s]

    def see(
        self, seconds: float, readings: Mapping[str, Reading], motion: RigidBodyState | None = None
    ) -> None:
        """Take how long it was since the last call [s], and readings and motion at the end; None: not measured."""
        if not self._watches:
            return
        reading = readings.get(NAME)
        refusal = "" if reading is None else SENSORS[NAME].problem(reading, self._robot)
        if reading is None or refusal:
            self._silent_s += seconds
            self._refusal = refusal or self._refusal
        else:
            self._average(self._silent_s + seconds, float(reading.value))
            self._silent_s, self._refusal, self.pressure = 0.0, "", float(reading.value)
            self._find_empty(motion)
            self._low = self._robot.actuators.supply_warning(self.pressure)
        self.warning = self._words()

    def _average(self, seconds: float, pressure: float) -> None:
        before = pressure if self.pressure is None else self._mean
        self._seen_s += 0.0 if self.pressure is None else seconds
        self._mean = before + (pressure - before) * -math.expm1(-seconds / MEAN_S)

    def _find_empty(self, motion: RigidBodyState | None) -> None:
        tank = self._robot.actuators.tank
        known = self._seen_s >= MEAN_S  # the first readings alone are no mean
        if self.empty is None and known and tank is not None and tank.is_empty(self._mean):
            self.empty = Finding("", f"{EMPTY}{_drift(motion)}")

    def _words(self) -> str:
        if self.pressure is None:  # drivers of devices without a gauge never say one
            return f"the supply pressure is refused: {self._refusal}" if self._refusal else ""
        if self._silent_s > self._silent_after_s:
            why = f": {self._refusal}" if self._refusal else ""
            return f"no supply pressure for {self._silent_s:.0f} s{why}. Is the gauge connected?"
        return self._low


def _drift(motion: RigidBodyState | None) -> str:
    """How a body moves on that nothing pushes; empty where its motion is not measured."""
    if motion is None:
        return ""
    velocity, rate = motion.velocity_in_world, motion.angular_velocity_in_body
    along = ", ".join(f"{axis} {each:+.2f}" for axis, each in zip("xyz", velocity.tolist(), strict=True))
    turn = math.degrees(math.hypot(*rate.tolist()))
    return (
        f"; it drifts on with {math.hypot(*velocity.tolist()):.2f} m/s ({along}) and turns with {turn:.1f}°/s"
    )
