"""Air data of an ArduPlane: airspeed by VFR_HUD, angles by AOA_SSA or as in still air, height above its origin."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.air_data import NAME, AirData
from fulmar_core.states.rotation import rotate_inverse
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.reading import Reading


class PlaneAir:
    """Keeps what the autopilot says of the air, and makes readings of what the robot's file names."""

    def __init__(self, robot: Robot) -> None:
        """Begin with nothing known."""
        spec = robot.sensors.specs.get(NAME)
        self._names: tuple[str, ...] = () if spec is None else tuple(spec.names)
        self._airspeed: float | None = None
        self._angles: tuple[float, float] | None = None  # of attack and sideslip [rad]

    def take(self, message: Any) -> None:
        """Take any message of the autopilot."""
        kind = message.get_type()
        if kind == "VFR_HUD" and math.isfinite(message.airspeed):
            self._airspeed = float(message.airspeed)
        elif kind == "AOA_SSA" and math.isfinite(message.AOA) and math.isfinite(message.SSA):
            self._angles = math.radians(message.AOA), math.radians(message.SSA)

    @property
    def airspeed_words(self) -> str:
        """The airspeed as text [m/s]; empty as long as it is not known."""
        return "" if self._airspeed is None else f"{self._airspeed:.1f}"

    def readings(self, state: RigidBodyState, stamp_ns: int) -> dict[str, Reading]:
        """Air data beside a position of this time [ns]; none before the first airspeed, or where no sensor asks."""
        if not self._names or self._airspeed is None:
            return {}
        alpha, beta = self._angles or still_angles(state)
        every = {
            "airspeed": self._airspeed, "alpha": alpha, "beta": beta, "height": float(state.position_in_world[2])
        }  # fmt: skip
        values = np.array([every[name] for name in self._names])
        return {NAME: Reading(AirData(self._names, values), stamp_ns=stamp_ns)}


def still_angles(state: RigidBodyState) -> tuple[float, float]:
    """Angles of attack and sideslip in still air [rad]; sideslip is positive where the wind comes from the right."""
    ahead, left, up = rotate_inverse(state.quat_xyzw, np.asarray(state.velocity_in_world)).tolist()
    speed = math.sqrt(ahead**2 + left**2 + up**2)
    return math.atan2(-up, ahead), math.asin(max(-1.0, min(1.0, -left / speed))) if speed > 1e-6 else 0.0
