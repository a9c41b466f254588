"""Propellers: thrust and torque of electric and piston engines over airspeed.

Electric: Fitzpatrick's model as Beard and McLain and PyFly have it, T = ½ ρ S C V_d (V_d − V), V_d = V + δ (k_m − V).
Piston: constant power, T = δ P η / V, cut at the static thrust.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from fulmar_core.states.arrays import clip
from fulmar_core.states.rotation import Array

FASTEST_TIP = 343.0  # of a propeller's blades: the speed of sound [m/s]
SLOWEST = 0.1  # airspeed that a piston engine's thrust is computed for at the least [m/s]


@dataclass(frozen=True)
class ElectricMotor:
    """A propeller on an electric motor."""

    kind: Literal["electric"]
    thrust: float  # largest [N]
    disc_area: float  # S [m²]
    efficiency: float  # C [-]
    jet_speed: float  # k_m: speed of the jet at full throttle [m/s]
    torque_per_speed2: float = 0.0  # reaction of the propeller per squared turn rate [N·m·s²]
    top_rate: float = 0.0  # turn rate of the propeller at full throttle [rad/s]

    def __post_init__(self) -> None:
        if min(self.thrust, self.disc_area, self.efficiency, self.jet_speed) <= 0.0:
            raise ValueError("thrust, disc_area, efficiency and jet_speed must be greater than 0.")
        if min(self.torque_per_speed2, self.top_rate) < 0.0:
            raise ValueError(
                f"'torque_per_speed2' = {self.torque_per_speed2:g} N·m·s² and 'top_rate' = {self.top_rate:g} rad/s "
                "must not be negative; the motor's 'rotation' says which way it turns."
            )
        tip = math.sqrt(self.disc_area / math.pi)
        if self.top_rate * tip > FASTEST_TIP:
            raise ValueError(
                f"'top_rate' = {self.top_rate:g} rad/s turns the tips of 'disc_area' = {self.disc_area:g} m² at "
                f"{self.top_rate * tip:.4g} m/s; at most {FASTEST_TIP / tip:.4g} rad/s, the speed of sound. Is it in "
                f"rpm? {self.top_rate:g} rpm are {self.top_rate * math.pi / 30.0:.4g} rad/s."
            )
        if 0.0 < self.top_rate * tip < self.jet_speed:
            raise ValueError(
                f"'top_rate' = {self.top_rate:g} rad/s turns the tips of 'disc_area' = {self.disc_area:g} m² at "
                f"{self.top_rate * tip:.4g} m/s, slower than 'jet_speed' = {self.jet_speed:g} m/s; it must be at least "
                f"{self.jet_speed / tip:.4g} rad/s. One rad/s is 9.549 rpm."
            )
        if self.torque_at(1.0) > 2.0 * tip * self.thrust:
            raise ValueError(
                f"'torque_per_speed2' = {self.torque_per_speed2:g} N·m·s² makes {self.torque_at(1.0):.4g} N·m at "
                f"'top_rate'; at most {2.0 * tip * self.thrust / self.top_rate**2:.4g}: thrust · the disc's diameter."
            )

    def thrust_at(self, throttle: Array, airspeed: Array, density: Array) -> Array:
        """Thrust, shape (...,) [N]; throttle from 0 to 1, airspeed [m/s], density [kg/m³]."""
        more = throttle * (self.jet_speed - airspeed)
        push = (0.5 * self.disc_area * self.efficiency) * density * (airspeed + more) * more
        return clip(push, 0.0, self.thrust)

    def torque_at(self, throttle: Array) -> Array:
        """Size of the reaction torque about the propeller's axis, shape (...,) [N·m]."""
        return self.torque_per_speed2 * self.top_rate**2 * throttle * throttle


@dataclass(frozen=True)
class PistonEngine:
    """A propeller of constant speed on a piston engine."""

    kind: Literal["piston"]
    thrust: float  # largest [N]
    power: float  # of the engine [W]
    efficiency: float  # of the propeller [-]

    def __post_init__(self) -> None:
        if min(self.thrust, self.power, self.efficiency) <= 0.0:
            raise ValueError("thrust, power and efficiency must be greater than 0.")

    def thrust_at(self, throttle: Array, airspeed: Array, density: Array) -> Array:
        """Thrust, shape (...,) [N]; arguments as in `ElectricMotor.thrust_at`."""
        return clip(
            throttle * (self.power * self.efficiency) / clip(airspeed, SLOWEST, None), 0.0, self.thrust
        )

    def torque_at(self, throttle: Array) -> Array:
        """None is modelled; see `ElectricMotor.torque_at`."""
        return 0.0 * throttle
