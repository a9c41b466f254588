"""Wiring of wheels and propellers: the side that each channel of a device turns, and its direction."""

from __future__ import annotations

import math
from collections.abc import Sequence

SIDES = ("left", "right")
AS_NAMED = SIDES


def check_wiring(wiring: Sequence[str]) -> None:
    """Reject a wiring that does not name both sides once; raises ValueError."""
    if sorted(side.removeprefix("-") for side in wiring) != sorted(SIDES):
        raise ValueError(
            f"'wiring' = {list(wiring)} must name left and right once each, with a '-' where it turns backwards: "
            "[left, right] or [-right, left]."
        )


def channels(wiring: Sequence[str], left: float, right: float) -> tuple[float, float]:
    """Values of a device's left and right channel for commands of the sides.

    Args:
        wiring: Side that each channel turns, `-left` or `-right` where a positive value turns it backwards.
        left: Command of the left side, of any unit.
        right: Same of the right side.
    """
    values = {"left": left, "right": right}
    first, second = (
        -values[side.removeprefix("-")] if side.startswith("-") else values[side] for side in wiring
    )
    return first, second


def channel_velocity(
    wiring: Sequence[str], track: float, speed: float, turn_rate: float
) -> tuple[float, float]:
    """Speed and turn rate to send, so that a base with this wiring moves at those that are commanded.

    Args:
        wiring: As in `channels`.
        track: Between the wheels [m].
        speed: Ahead [m/s].
        turn_rate: To the left [rad/s].

    Returns:
        Speed [m/s] and turn rate [rad/s].
    """
    if tuple(wiring) == AS_NAMED:
        return speed, turn_rate
    half = 0.5 * track * turn_rate
    left, right = channels(wiring, speed - half, speed + half)
    return 0.5 * (left + right), (right - left) / track


def bounded(left: float, right: float) -> tuple[float, float]:
    """Shares of full thrust within -1 to 1.

    If one is not finite, both propellers stop: `min` and `max` would turn it into full thrust, and one propeller alone
    would turn the boat.
    """
    if not (math.isfinite(left) and math.isfinite(right)):
        return 0.0, 0.0
    return max(-1.0, min(1.0, left)), max(-1.0, min(1.0, right))
