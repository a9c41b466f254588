"""The gas tank of thrusters: how its pressure falls with what is blown out, and what thrust is left.

An ideal gas at one temperature, p V = m R T, behind a regulator that holds the pressure of the nozzles until the
tank's own falls below it; from there on thrust falls with the pressure, as that of a choked nozzle does (Sutton and
Biblarz, Rocket Propulsion Elements, 9th ed., eq. 3-29 with a thrust coefficient that stays). Mass flow is
thrust / (specific impulse · g), their eq. 2-5.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from fulmar_core.states.arrays import clip
from fulmar_core.states.rotation import Array

GRAVITY = 9.80665  # of the definition of specific impulse [m/s²]
EMPTY = 0.1  # share of the full thrust below which a tank is empty: what is left would not stop a body in time [-]


@dataclass(frozen=True)
class Tank:
    """A tank and its regulator."""

    volume: float  # [m³]
    pressure: float  # when it is full, absolute [Pa]
    regulated: float  # that the regulator holds, absolute; below it thrust falls [Pa]
    specific_impulse: float  # of the nozzles [s]
    # Of air; nitrogen has 296.8 [J/(kg·K)].
    gas_constant: float = 287.05  # word: of an ideal gas
    temperature: float = 293.15  # of what is in it [K]
    leak: float = 0.0  # what flows whether thrust is asked for or not, such as through air bearings [kg/s]
    reserve_s: float = 60.0  # full thrust that is to be left when a warning comes [s]
    weighs: bool = (
        False  # `body` is meant with this tank full, and loses mass and inertia with what is blown out
    )

    def __post_init__(self) -> None:
        positive = (self.volume, self.regulated, self.specific_impulse, self._specific_energy)
        if min(positive) <= 0.0 or min(self.leak, self.reserve_s) < 0.0:
            raise ValueError("numbers of 'tank' must be greater than 0, leak and reserve_s not negative.")
        if self.pressure <= self.regulated:
            raise ValueError(
                f"'tank.pressure' = {self.pressure:g} Pa must be above 'tank.regulated', {self.regulated:g} Pa: a full "
                "tank feeds its regulator."
            )

    @property
    def _specific_energy(self) -> float:
        """Pressure times volume of a kilogram [J/kg]."""
        return self.gas_constant * self.temperature  # word: of an ideal gas

    @property
    def volume_per_kg(self) -> float:
        """That a kilogram takes in the full tank [m³/kg]."""
        return self._specific_energy / self.pressure

    @property
    def content(self) -> float:
        """Mass of what is in the full tank [kg]."""
        return self.volume / self.volume_per_kg

    @property
    def exhaust_speed(self) -> float:
        """Impulse of a kilogram of what is in it [m/s]."""
        return self.specific_impulse * GRAVITY

    def check_part_of(self, mass: float) -> None:
        """Refuse to be a part of a body of some mass that is no more than what is in it [kg].

        Raises:
            ValueError: With what to do.
        """
        if self.weighs and self.content >= mass:
            raise ValueError(
                f"'tank' holds {self.content:.3g} kg, and the whole body has 'mass' = {mass:g} kg: with 'weighs' the "
                "full tank is a part of it. Give the mass of the body with its tank full."
            )

    def left(self, pressure: Any) -> Any:
        """Mass of what is in it at some pressures [Pa], shape of these [kg]."""
        return pressure * (self.volume / self._specific_energy)

    def gone(self, pressure: Array) -> Array:
        """Mass that a full tank has lost at some pressures [Pa], shape of these [kg]."""
        return (self.pressure - pressure) * (self.volume / self._specific_energy)

    def share(self, pressure: Array) -> Array:
        """Share of the full thrust at some pressures in the tank, shape of these [-]."""
        return clip(pressure / self.regulated, 0.0, 1.0)

    def fall(self, thrust: Array) -> Array:
        """How fast the pressure falls under some thrusts [N], shape of these [Pa/s]."""
        flow = thrust / self.exhaust_speed + self.leak
        return flow * (self._specific_energy / self.volume)

    def is_empty(self, pressure: float) -> bool:
        """Whether hardly any thrust is left at a pressure [Pa]."""
        return pressure < EMPTY * self.regulated

    def lasts_s(self, pressure: float, thrust: float) -> float:
        """How long a thrust [N] lasts until it falls [s]."""
        return max(0.0, pressure - self.regulated) / max(float(self.fall(thrust)), 1e-300)

    def warning(self, pressure: float, thrust: float) -> str:
        """What is wrong with a pressure in the tank [Pa], with the thrust of all valves [N]; empty if nothing is."""
        bar = f"supply pressure {1e-5 * pressure:.3g} bar"
        if pressure < self.regulated:
            share = 100.0 * max(0.0, pressure) / self.regulated
            return (
                f"{bar} is below the {1e-5 * self.regulated:.3g} bar of the regulator: thrust has fallen to "
                f"{share:.0f} %. Stop and refill"
            )
        left_s = self.lasts_s(pressure, thrust)
        return (
            f"{bar} lasts for {left_s:.0f} s of full thrust. Refill soon" if left_s < self.reserve_s else ""
        )
