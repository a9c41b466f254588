"""How a robot looks: primitives on its body, read from `look` of its YAML. No mass, no contact: only for people."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from fulmar_core.states.attitude import from_euler

Shape = Literal["box", "cylinder", "sphere", "capsule", "cone", "mesh"]
Color = tuple[float, float, float, float]  # red, green, blue, opacity, each 0 to 1
NUMBERS = {"box": 3, "cylinder": 2, "sphere": 1, "capsule": 2, "cone": 2, "mesh": 0}  # of a size
LARGEST_M = 100.0
MOST_PARTS = 100
COLORS: dict[str, Color] = {
    "white": (0.92, 0.93, 0.95, 1.0),
    "silver": (0.72, 0.74, 0.78, 1.0),
    "grey": (0.45, 0.47, 0.51, 1.0),
    "dark": (0.16, 0.17, 0.20, 1.0),
    "black": (0.06, 0.06, 0.07, 1.0),
    "blue": (0.20, 0.45, 0.80, 1.0),
    "navy": (0.10, 0.17, 0.42, 1.0),
    "gold": (0.80, 0.62, 0.22, 1.0),
    "yellow": (0.96, 0.78, 0.15, 1.0),
    "orange": (0.95, 0.50, 0.14, 1.0),
    "red": (0.80, 0.16, 0.14, 1.0),
    "green": (0.25, 0.62, 0.32, 1.0),
    "copper": (0.72, 0.43, 0.25, 1.0),
    "glass": (0.35, 0.55, 0.70, 0.55),
    "own": (0.25, 0.45, 0.70, 1.0),  # where several robots are shown, each one's own colour
}


@dataclass(frozen=True)
class Part:
    """One primitive, or one mesh.

    Attributes:
        shape: What it is; round ones stand along their own z, and a cone points along it.
        size: Of a box its lengths along x, y, z; diameter and length of a cylinder, of a cone, and of a capsule with
            its round ends; diameter of a sphere; nothing of a mesh [m].
        at: Of its middle in the body's frame; of a mesh of the file's origin [m].
        rpy: Roll, pitch and yaw of its axes in the body's frame [deg].
        color: A name of `COLORS`.
        moves: Actuator that moves it; empty: it is fixed.
        about: Axis of its own that it turns about.
        gain: Of a surface or a steered wheel the angle by the command's; of what spins its speed by that of others.
        file: Of a mesh, STL, OBJ or GLB: in a robot's YAML relative to it, of a robot that is loaded absolute.
        scale: Of a mesh: metres per unit of its file along its x, y, z.
    """

    shape: Shape
    size: tuple[float, ...] = ()
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)
    color: str = "own"
    moves: str = ""
    about: tuple[float, float, float] = (0.0, 0.0, 1.0)
    gain: float = 1.0
    file: str = ""
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        """Refuse what cannot be drawn."""
        if bool(self.file) != (self.shape == "mesh") or (self.file and self.size) or not all(self.scale):
            raise ValueError(
                "a mesh has a 'file', a 'scale' without 0, and no 'size'; other shapes have no 'file'."
            )
        wanted = NUMBERS[self.shape]
        if len(self.size) != wanted or not all(0.0 < each <= LARGEST_M for each in self.size):
            raise ValueError(f"'size' of a {self.shape} has {wanted} lengths above 0, up to {LARGEST_M:g} m.")
        if self.shape == "capsule" and self.size[1] < self.size[0]:
            raise ValueError("a capsule is at least as long as its diameter.")
        if not all(abs(each) <= LARGEST_M for each in self.at):
            raise ValueError(f"'at' lies within {LARGEST_M:g} m of the body's origin.")
        if self.color not in COLORS:
            raise ValueError(f"'color' is '{self.color}', must be one of {', '.join(COLORS)}.")
        if not math.isfinite(self.gain) or not any(self.about):
            raise ValueError("'gain' is a finite number, 'about' an axis.")

    @property
    def rgba(self) -> Color:
        """Its colour."""
        return COLORS[self.color]

    @property
    def quat_xyzw(self) -> tuple[float, float, float, float]:
        """How it is turned in the body's frame."""
        roll, pitch, yaw = (math.radians(each) for each in self.rpy)
        x, y, z, w = from_euler(roll, pitch, yaw)
        return float(x), float(y), float(z), float(w)


def check_look(parts: tuple[Part, ...], actuators: tuple[str, ...]) -> None:
    """Refuse too many parts, and those that an actuator moves which the robot does not have; raises ValueError."""
    if len(parts) > MOST_PARTS:
        raise ValueError(f"'look' has {len(parts)} parts, at most {MOST_PARTS}.")
    for number, part in enumerate(parts):
        if part.moves and part.moves not in actuators:
            raise ValueError(
                f"'look.{number}.moves' is '{part.moves}', must be an actuator: {', '.join(actuators)}."
            )
