"""The parts of a family that can stick, one by one: valves, surfaces, motors, wheels."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fulmar_core.config.errors import shortened

RESERVED = {"base": "base_link", "imu": "imu_link"}  # names of parts whose frames others have
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")


def check_part_names(names: Sequence[str]) -> None:
    """Refuse names that no frame, link of a URDF, or part of a simulator can have.

    Args:
        names: Of actuators.

    Raises:
        ValueError: Names the first such one, and what is allowed.
    """
    for number, name in enumerate(names, start=1):
        if not _NAME.fullmatch(name):
            raise ValueError(
                f"actuator {number} has the name '{shortened(name)}': it must begin with a letter and have only "
                "letters, digits and underscores, 64 at most. Example: thruster_1"
            )
        if name in RESERVED:
            raise ValueError(
                f"actuator {number} has the name '{name}': its frame would be {RESERVED[name]}, which each robot has "
                f"already. Take another name, such as {name}_1."
            )


@dataclass(frozen=True)
class Fixture:
    """A part on the body, as people see it."""

    name: str
    position: tuple[float, float, float]  # in the body's frame [m]
    axis: tuple[float, float, float] | None = None  # along which its x axis points; None: as the body's
    wheel: tuple[
        float, ...
    ] = ()  # radius and width, the axle along y; of a ball the radius; none: a nozzle [m]


@dataclass(frozen=True)
class MovingParts:
    """Parts that commands move; there are as many of them as a command has numbers.

    Attributes:
        names: Of the parts.
        lowest: Smallest value of each, shape (n,).
        scale: Largest value of each, shape (n,).
        per_command: Values of the parts per unit of each number of a command, shape (n, n) and invertible; None: a
            command's numbers are the values of the parts.
    """

    names: tuple[str, ...]
    lowest: np.ndarray
    scale: np.ndarray
    per_command: np.ndarray | None = None
