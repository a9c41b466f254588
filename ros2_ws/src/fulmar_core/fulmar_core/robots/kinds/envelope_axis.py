"""The axes of an operating envelope: conditions that a certification varies, from easy to hard."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

# Quantities of a robot's file that the end of an axis is a multiple of; empty: the end is in the axis' own unit.
Scale = Literal["", "force", "torque", "top_speed", "yaw_rate", "radius"]


@dataclass(frozen=True)
class EnvelopeAxis:
    """One condition. Factors x mean that a quantity is multiplied or divided by x."""

    name: str
    unit: str
    high: float  # the hardest value, in `unit`, or as a multiple of `of`
    low: float = 0.0  # the easiest value, likewise
    of: Scale = ""
    water: bool | None = None  # True: of robots alone that water carries; False: of all others; None: of all


MASS = EnvelopeAxis("mass", "x", 2.0, 1.0)
INERTIA = EnvelopeAxis("inertia", "x", 3.3, 1.0)
THRUST_LOSS = EnvelopeAxis("thrust_loss", "share", 0.5)
DELAY = EnvelopeAxis("delay", "s", 0.2)
VELOCITY_NOISE = EnvelopeAxis("velocity_noise", "m/s", 0.15)
DISTANCE = EnvelopeAxis("distance", "m", 8.0)
# What robots meet that are pushed, on a floor, on water or in space.
PUSHED = (
    DISTANCE,
    EnvelopeAxis("speed", "m/s", 1.0, of="top_speed"),
    EnvelopeAxis("turn_rate", "rad/s", 3.3, of="yaw_rate"),
    EnvelopeAxis("force", "N", 0.6, of="force", water=False),
    EnvelopeAxis("torque", "N·m", 0.4, of="torque", water=False),
    MASS,
    INERTIA,
    THRUST_LOSS,
    DELAY,
    VELOCITY_NOISE,
    EnvelopeAxis("center_of_mass", "m", 0.2, of="radius"),
)
