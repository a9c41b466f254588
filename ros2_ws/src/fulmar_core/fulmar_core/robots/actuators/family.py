"""What every family of actuators says about itself, with defaults for what a family need not have.

A family is a frozen dataclass that is read from the `actuators` of a robot's YAML: one file beside this one, and one
row in `families.py`. Families that push at places derive from `Pushing`, those on wheels from `Rolling`.
"""

from __future__ import annotations

import functools
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import Field
from typing import Any, ClassVar

import numpy as np

from fulmar_core.config.plausible_ranges import Plausible
from fulmar_core.robots.actuators.excitation import Excitation
from fulmar_core.robots.actuators.parts import Fixture, MovingParts
from fulmar_core.robots.actuators.refuge import Refuge, StopAtOnce
from fulmar_core.robots.actuators.response import Response
from fulmar_core.robots.actuators.tank import Tank
from fulmar_core.states.rotation import Array


def check_names(key: str, one: str, names: Sequence[str]) -> None:
    """Reject a list of actuators that is empty, or in which two have one name.

    Args:
        key: Of the list in the YAML.
        one: What one of them is called.
        names: Theirs.

    Raises:
        ValueError: Says which of both.
    """
    if not names:
        raise ValueError(f"'{key}' has no {one}. Give one or more, each with a 'name'.")
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ValueError(
            f"'{key}' has {names.count(twice)} with the name '{twice}'. Give each {one} a name of its own."
        )


class Actuators(ABC):
    """One family. A command has one value for each actuator, shape (..., n), in the order of `names`.

    Attributes:
        kind: Name of the family: the key `kind` of the YAML.
        response: How fast actuators follow their commands.
        tank: What feeds thrusters; None: their supply never falls by itself.
        excitation: Random commands that identify it; None: the controller `excite` rejects the family.
        one_way: Commands go from 0 to `scale`; else from -scale to scale.
        opens_late: Actuators may take longer to begin than to end, as valves do.
        turns_only: Commands turn the body and push it nowhere.
        flies: Commands steer an aircraft, which the robot's `airframe` describes.
        calibrated: Quantities that identification measures of it, beside those of `Kind.calibrated`.
        takes_velocity: A command is (speed, turn rate) of the body, which ROS has a message of its own for.
        plausible: Ranges of the family's own keys beside those of `plausible_ranges.ROBOT`, or in their place.
    """

    kind: str
    response: Response
    tank: Tank | None = None
    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]  # every family is a frozen dataclass

    excitation: ClassVar[Excitation | None] = None
    one_way: ClassVar[bool] = False
    opens_late: ClassVar[bool] = False
    turns_only: ClassVar[bool] = False
    takes_velocity: ClassVar[bool] = False
    flies: ClassVar[bool] = False
    calibrated: ClassVar[tuple[str, ...]] = ()
    plausible: ClassVar[tuple[Plausible, ...]] = ()

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Names of the actuators."""

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each command, in the order of `names`; by default a share of the full one."""
        return ("of full command",) * len(self.names)

    @property
    @abstractmethod
    def scale(self) -> np.ndarray:
        """Largest command of each, shape (n,)."""

    @abstractmethod
    def limited(self, command: Array) -> Array:
        """Nearest command that the hardware can carry out, shape (..., n)."""

    def ranges(self, robot: Any) -> tuple[Plausible, ...]:
        """`plausible`, with what depends on how the file of this robot says it."""
        return self.plausible

    @property
    def positions(self) -> int:
        """How many of the actuators, the first ones, are commanded by a position: surfaces on servos."""
        return 0

    @property
    def own_response(self) -> Response:
        """What of `response` happens before the dynamics, which have the rest."""
        return self.response

    @property
    def remembers(self) -> bool:
        """Whether what an actuator does depends on more than the newest command."""
        return self.response.remembers

    @property
    def binary(self) -> bool:
        """Whether actuators know only on and off."""
        return False

    @property
    def lowest(self) -> np.ndarray:
        """Smallest command of each, shape (n,)."""
        return 0.0 * self.scale if self.one_way else -self.scale

    @property
    def parts(self) -> MovingParts:
        """What of it can stick, one by one: what its commands name."""
        return MovingParts(self.names, self.lowest, self.scale)

    @property
    def fixtures(self) -> tuple[Fixture, ...]:
        """What of it can be seen on the body."""
        return ()

    @property
    def full_wrenches(self) -> tuple[np.ndarray, np.ndarray, bool] | None:
        """What commands make about the body's origin, one by one; None where that is not of single actuators.

        Returns:
            Wrench of each at its full command, shape (n, 6) [N, N·m], its least share of that, shape (n,) [-], and
            whether one supply feeds all.
        """
        return None

    @property
    def safe_command(self) -> np.ndarray:
        """Command that moves nothing by itself, shape (n,)."""
        return np.zeros(len(self.names))

    @functools.cached_property
    def refuge(self) -> Refuge:
        """What is applied when commands end."""
        return StopAtOnce(self.safe_command)

    def total_thrust(self, applied: Array) -> Array:
        """What a tank feeds: thrust of all nozzles together at its full pressure, 0 of a family that has none [N].

        Args:
            applied: What each actuator does, shape (n, ...).

        Returns:
            Shape (...,).
        """
        return 0.0 * applied.sum(0)

    def supply_warning(self, pressure: float) -> str:
        """What is wrong with a pressure of the tank [Pa]; empty where nothing is, or no tank is described."""
        return "" if self.tank is None else self.tank.warning(pressure, float(self.total_thrust(self.scale)))

    def hull_span(self, height: float) -> tuple[float, float]:
        """Bottom and top of a hull of this height in the body's frame, on land or in the air [m]."""
        return -0.5 * height, 0.5 * height

    @property
    def recipe(self) -> str:
        """Training settings where a robot and task have none of their own: a file of `configs/training`."""
        return self.kind

    @property
    def sideways(self) -> bool:
        """Whether a robot moves to either side without turning."""
        return False

    @property
    def largest_yaw_rate(self) -> float | None:
        """The fastest turn that a command can ask for [rad/s]; None where the robot's `limits` say it."""
        return None

    @property
    def largest_curvature(self) -> float | None:
        """Of the tightest circle that it drives [1/m]; None where it turns on the spot."""
        return None

    def by_hand(self, ahead: float, left: float, turn: float) -> np.ndarray | None:
        """Command for what a person asks for, each from -1 to 1 of what the robot can.

        Returns:
            Shape (n,), within the limits; None where it is found by allocating the wrench that is asked for.

        Raises:
            ValueError: A person cannot drive this family.
        """
        raise ValueError(f"robots with {self.kind} are not driven by hand.")

    def random_commands(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """Commands to excite a robot with, shape (count, n): anything between the ends, or some one-way actuators.

        Args:
            rng: Source of randomness.
            count: How many.
        """
        shape = count, len(self.scale)
        if not self.one_way:
            return np.asarray(self.limited(rng.uniform(-1.0, 1.0, shape) * self.scale))
        order = np.argsort(rng.random(shape), axis=1)
        working = order < rng.integers(1, 4, size=(count, 1))
        return np.asarray(working * (1.0 if self.binary else rng.random(shape)) * self.scale)

    def mirrored(self) -> np.ndarray | None:
        """Matrix from shares of a command to those of its mirror image, left for right, shape (n, n); None for none."""
        return None

    def turned(self) -> np.ndarray | None:
        """Same for a robot that is turned round, front for back."""
        return None
