"""Electrically driven fans that push one way by degrees, as free-flying robots inside of space stations have them."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Literal

from fulmar_core.config.plausible_ranges import Plausible
from fulmar_core.robots.actuators.pushing import Mount, OneWay, Push
from fulmar_core.robots.actuators.response import Response
from fulmar_core.states.arrays import clip
from fulmar_core.states.rotation import Array


class Fan(Mount):
    """One fan."""

    WHAT = "fan"


@dataclass(frozen=True)
class Fans(OneWay):
    """A command is the share of full thrust, 0 to 1, for each fan; fans have nothing in common that they share.

    Int-Ball2 (`jaxa/int-ball2_simulator`, `ib2_gazebo/sim/sim.yaml`) has eight of 0.06 N with a lag of 0.01 s. A driver
    turns the share into the motor's duty, which there goes with the root of the thrust.
    """

    kind: Literal["fans"]
    thrust: float  # of one fan at full speed [N]
    fans: tuple[Fan, ...]
    response: Response = Response()

    shared_pressure = False
    plausible = (
        Plausible(
            "actuators.fans.*.position", "m", (0.0, 1.3), (0.0, 1.1), "fans sit on the body, within its radius",
            scale=lambda robot: robot.body.radius, distance=True,
        ),
    )  # fmt: skip

    def __post_init__(self) -> None:
        if self.thrust <= 0.0:
            raise ValueError("'thrust' must be greater than 0.")
        self.check_parts("fans")

    @functools.cached_property
    def pushes(self) -> tuple[Push, ...]:
        """Place and direction of each fan."""
        return tuple(fan.push for fan in self.fans)

    @property
    def recipe(self) -> str:
        """What thrusters learn by; see `Actuators.recipe`."""
        return "thrusters"

    def limited(self, command: Array) -> Array:
        """Nearest command that the hardware can carry out, shape (..., n)."""
        return clip(command, 0.0, 1.0)

    def thrusts(self, command: Array) -> Array:
        """Thrust of each fan, shape (..., n) [N]; whatever errors add, a fan does not suck."""
        return self.thrust * clip(command, 0.0, 1.0)
