"""Forces of still water on a hull at its surface (Fossen, "Handbook of Marine Craft", 2011, §4.2, §6.3 to §6.5, §8.1).

The core's own dynamics move in the plane; simulators that also heave, roll and pitch take the functions of six-vectors:
[surge, sway, heave, roll, pitch, yaw] in the body's frame: velocities [m/s, rad/s] or forces [N, N·m].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from array_api_compat import device

from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.rotation import Array, cross

AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
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
        if min(self.water_density, self.waterplane_area, self.draught) <= 0.0:
            raise ValueError("water_density, waterplane_area and draught must be greater than 0.")
        if min(self.metacentric_height_roll, self.metacentric_height_pitch) <= 0.0:
            raise ValueError("metacentric heights must be greater than 0: the hull would capsize.")

    def wrench(self, rise: Array, up_in_body: Array, weight: Array) -> tuple[Array, Array]:
        """Buoyancy of a hull with vertical walls, and what rights it.

        Args:
            rise: Height above where the hull floats at rest, shape (...,) [m].
            up_in_body: The world's z axis in the body's frame, shape (..., 3).
            weight: What floats, shape (...,) [N].

        Returns:
            Force along the world's z axis, shape (...,) [N], never downwards; moment about the centre of mass in the
            body's frame, shape (..., 3) [N·m].
        """
        xp = array_namespace(rise)
        force = clip(weight - self.water_density * GRAVITY * self.waterplane_area * rise, 0.0, None)
        # sin(roll) cos(pitch) is the y part of the upward axis, -sin(pitch) its x part.
        roll = -weight * self.metacentric_height_roll * up_in_body[..., 1]
        pitch = weight * self.metacentric_height_pitch * up_in_body[..., 0]
        return force, xp.stack((roll, pitch, xp.zeros_like(roll)), axis=-1)


@dataclass(frozen=True)
class Hydrodynamics:
    """Damping and added mass of [surge, sway, heave, roll, pitch, yaw]."""

    linear_damping: Six  # [N per m/s] three times, [N·m per rad/s] three times
    quadratic_damping: Six  # [N per (m/s)²], [N·m per (rad/s)²]
    added_mass: Six  # of water that moves along [kg] three times, [kg·m²] three times
    hydrostatics: Hydrostatics

    def __post_init__(self) -> None:
        for name in ("linear_damping", "quadratic_damping", "added_mass"):
            least = min(getattr(self, name))
            if least < 0.0:
                axis = AXES[getattr(self, name).index(least)]
                raise ValueError(
                    f"'{name}' = {list(getattr(self, name))} has {least:g} for {axis}: damping and added "
                    "mass must not be negative."
                )

    def planar_damping(self, u: Array, v: Array, r: Array) -> tuple[Array, Array, Array]:
        """Force and moment of the water.

        Args:
            u: Speed ahead, shape (...,) [m/s].
            v: Speed to the left [m/s].
            r: Turn rate [rad/s].

        Returns:
            Force ahead [N], to the left [N], and yaw moment [N·m], shapes (...,).
        """
        (du, dv, dr), (qu, qv, qr) = _planar(self.linear_damping), _planar(self.quadratic_damping)
        return drag(u, du, qu), drag(v, dv, qv), drag(r, dr, qr)

    def damping(self, velocity: Array) -> Array:
        """Drag of the water.

        Args:
            velocity: Of the centre of mass through the water, shape (..., 6).

        Returns:
            Force and moment, shape (..., 6).
        """
        xp = array_namespace(velocity)
        kind = {"dtype": velocity.dtype, "device": device(velocity)}
        linear = xp.asarray(self.linear_damping, **kind)
        quadratic = xp.asarray(self.quadratic_damping, **kind)
        return -(linear + quadratic * xp.abs(velocity)) * velocity

    def with_added_mass(self, wrench: Array, velocity: Array, mass: Array, inertia: Array) -> Array:
        """Wrench under which a body without added mass moves as one with it does.

        With M the body's own mass and A the added one, both diagonal, the hull obeys (Fossen, eq. 6.10 and 6.43)
        (M + A) v' + C_M(v) v + C_A(v) v = wrench. A simulator that knows M alone needs M v' + C_M(v) v.

        Args:
            wrench: Everything else that acts on the centre of mass, shape (..., 6).
            velocity: Of the centre of mass, shape (..., 6).
            mass: Of the body, shape (..., 1) [kg].
            inertia: Its principal moments, shape (..., 3) [kg·m²].

        Returns:
            Shape (..., 6).
        """
        if max(self.added_mass) == 0.0:
            return wrench
        xp = array_namespace(wrench)
        added = xp.asarray(self.added_mass, dtype=wrench.dtype, device=device(wrench))
        own = xp.concat((xp.broadcast_to(mass, inertia.shape), inertia), axis=-1)
        v, omega = velocity[..., :3], velocity[..., 3:]
        of_body = xp.concat((mass * cross(omega, v), cross(omega, inertia * omega)), axis=-1)
        momentum = added * velocity
        p, h = momentum[..., :3], momentum[..., 3:]
        of_water = xp.concat((cross(omega, p), cross(v, p) + cross(omega, h)), axis=-1)
        return own * (wrench - of_body - of_water) / (own + added) + of_body

    @property
    def planar_added_mass(self) -> tuple[float, float, float]:
        """Of surge [kg], sway [kg] and yaw [kg·m²]."""
        return _planar(self.added_mass)


def drag(speed: Array, linear: Any, quadratic: Any) -> Array:
    """-(linear + quadratic |speed|) speed, in as few arrays as that takes.

    Args:
        speed: Shape (...,) [m/s or rad/s].
        linear: A number, or an array that broadcasts to the speed's shape.
        quadratic: Same.
    """
    force = array_namespace(speed).abs(speed)
    force *= -quadratic
    force -= linear
    force *= speed
    return force


def _planar(six: Six) -> tuple[float, float, float]:
    return six[0], six[1], six[5]
