"""What a URDF or an MJCF says of a robot, in one form: masses lumped into one body, frames, joints and shapes.

All places are in the frame of the root link until `moved` shifts them; axes are those of REP 103: x ahead, y to the
left, z up.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

NAME_THEM = "name them: --actuators"  # in what to write where no names were found

Geometry = Literal["box", "cylinder", "sphere", "capsule", "mesh"]
Spin = Literal["turns", "swings", "slides"]  # without an end, between two angles, along a line


@dataclass(frozen=True)
class Place:
    """A frame in another one."""

    position: np.ndarray  # shape (3,) [m]
    rotation: np.ndarray  # its axes as columns, shape (3, 3)

    @classmethod
    def origin(cls) -> Place:
        """The frame itself."""
        return cls(np.zeros(3), np.eye(3))

    def then(self, inner: Place) -> Place:
        """A frame that is given in this one, in the one that this is given in."""
        return Place(self.position + self.rotation @ inner.position, self.rotation @ inner.rotation)


@dataclass(frozen=True)
class Solid:
    """One shape of a link, for contact or for drawing.

    Attributes:
        shape: What it is; round ones stand along their own z.
        size: Box: lengths along x, y, z; cylinder and capsule: diameter, length with round ends; sphere: diameter;
            mesh: lengths of its bounding box [m].
        place: Of its middle; of a mesh that of the file's origin.
        link: That it belongs to.
        rgba: Colour, each 0 to 1; None: none is given.
        file: Of a mesh.
        scale: Of a mesh, metres per unit of the file along its x, y, z.
        middle: Of a mesh's bounding box in its own frame, scaled [m].
    """

    shape: Geometry
    size: tuple[float, ...]
    place: Place
    link: str
    rgba: tuple[float, ...] | None = None
    file: Path | None = None
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    middle: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def corners(self) -> np.ndarray:
        """Corners of its bounding box, shape (8, 3) [m]."""
        if self.shape in ("box", "mesh"):
            half = 0.5 * np.array(self.size)
        elif self.shape == "sphere":
            half = np.full(3, 0.5 * self.size[0])
        else:
            half = 0.5 * np.array([self.size[0], self.size[0], self.size[1]])
        signs = np.array(np.meshgrid(*([[-1.0, 1.0]] * 3))).reshape(3, -1).T
        within = signs * half + np.array(self.middle)
        return np.asarray(self.place.position + within @ self.place.rotation.T)


@dataclass(frozen=True)
class Joint:
    """One joint that moves.

    Attributes:
        name: Its name.
        link: What it moves.
        kind: How.
        place: Of its frame.
        axis: That it moves about or along, a unit vector of the root link, shape (3,).
        limit: Largest angle or way from the middle [rad or m]; None: none is given.
        effort: Largest torque or force [N·m or N]; None: none is given.
        velocity: Largest speed [rad/s or m/s]; None: none is given.
    """

    name: str
    link: str
    kind: Spin
    place: Place
    axis: np.ndarray
    limit: float | None = None
    effort: float | None = None
    velocity: float | None = None


@dataclass(frozen=True)
class Thrust:
    """A site with an actuator that pushes there, of an MJCF."""

    name: str
    position: np.ndarray  # shape (3,) [m]
    direction: np.ndarray  # of the force at a positive command, a unit vector, shape (3,)
    newtons: float  # at the largest command; 0: the file has no range [N]


@dataclass(frozen=True)
class Gap:
    """Something that was not taken from a file."""

    key: str  # of the robot's file that it is about; empty: of none
    why: str  # in a few words
    write: str = ""  # what to do

    def __str__(self) -> str:
        """One line."""
        about = f"{self.key}: " if self.key else ""
        return f"{about}{self.why}" + (f"; {self.write}" if self.write else "")


@dataclass(frozen=True)
class Lump:
    """Mass properties of what is fixed together."""

    mass: float  # [kg]
    com: np.ndarray  # shape (3,) [m]
    tensor: np.ndarray  # about the centre of mass, shape (3, 3) [kg·m²]

    @classmethod
    def of(cls, parts: Iterable[Lump]) -> Lump:
        """Several bodies as one, by the parallel axis theorem; massless ones count for nothing."""
        heavy = [part for part in parts if part.mass > 0.0]
        mass = sum(part.mass for part in heavy)
        if mass == 0.0:
            return cls(0.0, np.zeros(3), np.zeros((3, 3)))
        com = sum((part.mass * part.com for part in heavy), np.zeros(3)) / mass
        tensor = np.zeros((3, 3))
        for part in heavy:
            arm = part.com - com
            tensor += part.tensor + part.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        return cls(mass, com, tensor)


@dataclass(frozen=True)
class Description:
    """A robot as a URDF or an MJCF has it, its joints at zero.

    Attributes:
        source: The file.
        name: Of the robot in it.
        lump: All of it as one body.
        frames: Of links and sites, by name, in the order of the file.
        joints: Those that move.
        contacts: Shapes that touch.
        visuals: Shapes that are drawn.
        thrusts: Sites with actuators.
        gaps: What was not taken.
        folders: Where a mesh is looked for, for messages.
    """

    source: Path
    name: str
    lump: Lump
    frames: dict[str, Place]
    joints: tuple[Joint, ...] = ()
    contacts: tuple[Solid, ...] = ()
    visuals: tuple[Solid, ...] = ()
    thrusts: tuple[Thrust, ...] = ()
    gaps: tuple[Gap, ...] = field(default=())

    def moved(self, origin: np.ndarray) -> Description:
        """The same about another origin, shape (3,) [m]."""

        def there(place: Place) -> Place:
            return replace(place, position=place.position - origin)

        return replace(
            self,
            lump=replace(self.lump, com=self.lump.com - origin),
            frames={name: there(place) for name, place in self.frames.items()},
            joints=tuple(replace(each, place=there(each.place)) for each in self.joints),
            contacts=tuple(replace(each, place=there(each.place)) for each in self.contacts),
            visuals=tuple(replace(each, place=there(each.place)) for each in self.visuals),
            thrusts=tuple(replace(each, position=each.position - origin) for each in self.thrusts),
        )

    def named(self, words: Iterable[str]) -> dict[str, Place]:
        """Frames whose names have one of some words, by name."""
        words = tuple(words)
        return {
            name: place for name, place in self.frames.items() if any(word in name.lower() for word in words)
        }
