"""Lift and induced drag of a wing near the ground.

W. F. Phillips and D. F. Hunsaker, "Lifting-Line Predictions for Induced Drag and Lift in Ground Effect", AIAA
2013-2917, Journal of Aircraft 50(4): ratios to free air at the same angle of attack, of the height of the wing over its
span. Beside a vortex lattice they hold within 0.02 (lift, from a quarter of a span on) and 0.015 (induced drag, from a
fifth of a span on); lower down the vortex lattice has more lift (tests/fulmar_core/dynamics/ground_effect.json).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.rotation import Array

LOWEST = 0.02  # heights below count as this: a wing on the water [spans]
HIGHEST = 4.0  # from which on it is free air to 1e-3 [spans]


@dataclass(frozen=True)
class GroundEffect:
    """Which part of the drag the ground lessens, and the wing that it is about."""

    drag: Literal["induced", "total"] = (
        "induced"  # total: as the thesis has it (eq. 5.5), which overstates it
    )
    wing_height: float = 0.0  # of the wing above the centre of mass [m]
    efficiency: float = 0.9  # Oswald's, of the induced part of the drag in free air [-]

    def __post_init__(self) -> None:
        if not 0.3 <= self.efficiency <= 1.2:
            raise ValueError(f"'efficiency' = {self.efficiency:g}: Oswald's number lies between 0.3 and 1.2.")


def lift_ratio(height: Array, aspect_ratio: float, taper: float) -> Array:
    """Lift near the ground over that in free air, at one angle of attack, shape (...,) [-].

    Args:
        height: Of the wing over its span, > 0, shape (...,) [-].
        aspect_ratio: Of the wing [-].
        taper: Chord at the tip over that at the root [-].
    """
    xp = array_namespace(height)
    delta = 1.0 - 2.25 * (taper**0.00273 - 0.997) * (aspect_ratio**0.717 + 13.6)
    log = xp.log(height)
    return 1.0 + (delta * 288.0 / aspect_ratio**0.882) * xp.exp(0.787 * log - 9.14 * xp.exp(0.327 * log))


def induced_drag_ratio(height: Array, aspect_ratio: float, taper: float) -> Array:
    """C_Di / C_L² near the ground over that in free air, shape (...,) [-]; arguments as in `lift_ratio`."""
    xp = array_namespace(height)
    delta = 1.0 - 0.157 * (taper**0.775 - 0.373) * (aspect_ratio**0.417 - 1.27)
    log = xp.log(height)
    near = delta * xp.exp(-4.74 * xp.exp(0.814 * log))
    return 1.0 - near - height * height * xp.exp(-3.88 * xp.exp(0.758 * log))


def near_ground(
    lift: Array,
    drag: Array,
    height: Array,
    *,
    effect: GroundEffect,
    aspect_ratio: float,
    taper: float,
    span: float,
) -> tuple[Array, Array]:
    """Coefficients of lift and drag near the ground.

    At one angle of attack C_L = C_L∞ R_L, and the induced part of the drag is C_Di = C_Di∞ R_D R_L².

    Args:
        lift: C_L in free air, shape (...,) [-].
        drag: C_D in free air, same shape [-].
        height: Of the centre of mass above the ground, same shape [m].
        effect: See `GroundEffect`.
        aspect_ratio: Of the wing [-].
        taper: Of the wing [-].
        span: Of the wing [m].
    """
    share = clip((height + effect.wing_height) / span, LOWEST, HIGHEST)
    more = lift_ratio(share, aspect_ratio, taper)
    factor = induced_drag_ratio(share, aspect_ratio, taper) * more * more
    lessened = drag
    if effect.drag == "induced":
        lessened = lift * lift / (math.pi * aspect_ratio * effect.efficiency)
    return lift * more, drag - (1.0 - factor) * lessened
