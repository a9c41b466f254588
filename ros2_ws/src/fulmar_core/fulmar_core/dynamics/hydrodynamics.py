"""Forces of still water on a hull at its surface, in the plane (Fossen, "Handbook of Marine Craft", 2011, §6.5 and §8.1).

Heave, roll and pitch belong to the simulator that has them; their numbers stand here all the same, one definition for
every user.
"""

from __future__ import annotations

from dataclasses import dataclass

from array_api_compat import array_namespace

from fulmar_core.rotation import Array

Six = tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class Hydrostatics:
    """What keeps the hull up and upright."""

    water_density: float  # [kg/m³]
    waterplane_area: float  # [m²]
    draught: float  # depth of the hull's lowest point at rest [m]
    metacentric_height_roll: float  # transverse GM: moment = -m g GM sin(roll) [m]
    metacentric_height_pitch: float  # longitudinal GM [m]

    def __post_init__(self) -> None:
        """Refuse hulls that sink or capsize."""
        if min(self.water_density, self.waterplane_area, self.draught) <= 0.0:
            raise ValueError("water_density, waterplane_area and draught must be greater than 0.")
        if min(self.metacentric_height_roll, self.metacentric_height_pitch) <= 0.0:
            raise ValueError("metacentric heights must be greater than 0: the hull would capsize.")


@dataclass(frozen=True)
class Hydrodynamics:
    """Damping and added mass of [surge, sway, heave, roll, pitch, yaw]."""

    linear_damping: Six  # [N per m/s] three times, [N·m per rad/s] three times
    quadratic_damping: Six  # [N per (m/s)²], [N·m per (rad/s)²]
    added_mass: Six  # of water that moves along [kg] three times, [kg·m²] three times
    hydrostatics: Hydrostatics

    def __post_init__(self) -> None:
        """Refuse water that pushes."""
        if min(*self.linear_damping, *self.quadratic_damping, *self.added_mass) < 0.0:
            raise ValueError("damping and added mass must not be negative.")

    def planar_damping(self, u: Array, v: Array, r: Array) -> tuple[Array, Array, Array]:
        """Force and moment of the water.

        Args:
            u: Speed ahead, shape (...,) [m/s].
            v: Speed to the left [m/s].
            r: Turn rate [rad/s].

        Returns:
            Force ahead [N], to the left [N], and yaw moment [N·m], shapes (...,).
        """
        xp = array_namespace(u)
        (du, dv, dr), (qu, qv, qr) = _planar(self.linear_damping), _planar(self.quadratic_damping)
        return (
            -(du + qu * xp.abs(u)) * u,
            -(dv + qv * xp.abs(v)) * v,
            -(dr + qr * xp.abs(r)) * r,
        )

    @property
    def planar_added_mass(self) -> tuple[float, float, float]:
        """Of surge [kg], sway [kg] and yaw [kg·m²]."""
        return _planar(self.added_mass)


def _planar(six: Six) -> tuple[float, float, float]:
    return six[0], six[1], six[5]
