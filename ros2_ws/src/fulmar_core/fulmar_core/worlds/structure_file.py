"""A file of `configs/things`: the shapes of a thing in space with whole, true sizes, and where these come from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from fulmar_core.config.strict_yaml import Kinds, positive
from fulmar_core.states.attitude import from_euler
from fulmar_core.worlds.structure_parts import COLORS, KeepOut, Part

AXES = {"x": (0.0, 90.0, 0.0), "y": (-90.0, 0.0, 0.0), "z": (0.0, 0.0, 0.0)}  # that turn z into it [deg]
Point = tuple[float, float, float]


@dataclass(frozen=True)
class _Part:
    """What every shape has in a file."""

    name: str
    at: tuple[Point, ...]  # places of its middle; the parts of several are numbered [m]
    semantic: Literal[
        "module", "truss", "solar_panel", "radiator", "antenna", "docking_port", "engine", "arm", "bus"
    ]
    source: str  # a key of the file's `sources`


@dataclass(frozen=True)
class _Box(_Part):
    kind: Literal["box"]
    size: Point  # whole sides [m]
    angles_deg: Point = (0.0, 0.0, 0.0)  # roll, pitch, yaw

    def __post_init__(self) -> None:
        positive(**{f"size entry {i + 1}": side for i, side in enumerate(self.size)})

    @property
    def half_sizes(self) -> tuple[float, ...]:
        return tuple(0.5 * side for side in self.size)


@dataclass(frozen=True)
class _Round(_Part):
    kind: Literal["cylinder", "capsule"]
    diameter: float  # [m]
    length: float  # in all [m]
    axis: Literal["x", "y", "z"] = "z"

    def __post_init__(self) -> None:
        positive(diameter=self.diameter, length=self.length)
        if not self.half_sizes[-1] > 0.0:
            raise ValueError(f"a {self.kind} must be longer than its diameter; a sphere is not.")

    @property
    def half_sizes(self) -> tuple[float, ...]:
        return 0.5 * self.diameter, 0.5 * self.length

    @property
    def angles_deg(self) -> Point:
        return AXES[self.axis]


@dataclass(frozen=True)
class _Capsule(_Round):
    kind: Literal["capsule"]

    @property
    def half_sizes(self) -> tuple[float, ...]:
        return 0.5 * self.diameter, 0.5 * (self.length - self.diameter)


@dataclass(frozen=True)
class _Sphere(_Part):
    kind: Literal["sphere"]
    diameter: float  # [m]
    angles_deg = AXES["z"]

    def __post_init__(self) -> None:
        positive(diameter=self.diameter)

    @property
    def half_sizes(self) -> tuple[float, ...]:
        return (0.5 * self.diameter,)


SHAPES = {"box": _Box, "cylinder": _Round, "capsule": _Capsule, "sphere": _Sphere}


@dataclass(frozen=True)
class StructureFile:
    """A file of `configs/things`."""

    title: str
    scale: float  # of the thing to the true one [-]
    sources: dict[str, str]  # where sizes come from, by the words that parts use
    parts: tuple[Annotated[_Box | _Round | _Sphere, Kinds(SHAPES)], ...]
    keep_out: KeepOut | None = None  # true metres; none: a sphere about the origin

    def __post_init__(self) -> None:
        positive(scale=self.scale)
        if not self.parts:
            raise ValueError(
                "'parts' is empty, and a thing without a surface cannot be inspected; give it one."
            )
        for part in self.parts:
            if not part.at:
                raise ValueError(f"part '{part.name}' stands nowhere; give 'at' a place.")
            if part.source not in self.sources:
                raise ValueError(
                    f"part '{part.name}' has the source '{part.source}', which is none of: {', '.join(self.sources)}."
                )


def scaled_parts(part: _Box | _Round | _Sphere, scale: float) -> list[Part]:
    """A part of a file as parts of a structure, one for each of its places."""
    size = tuple(scale * half for half in part.half_sizes)
    x, y, z, w = (float(number) for number in from_euler(*np.deg2rad(part.angles_deg)))
    return [
        Part(
            part.name if len(part.at) == 1 else f"{part.name}_{i + 1}",
            part.kind,
            size,
            (*(scale * coordinate for coordinate in place), w, x, y, z),
            part.semantic,
            COLORS[part.semantic],
        )
        for i, place in enumerate(part.at)
    ]
