"""Geometry of an aircraft's wing, tail and fin, as read from a file, and the lattices of their surfaces.

Places are from the centre of mass in metres: ahead, and up. Lattices have x aft, y right, z up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

ROWS, WING_COLUMNS, TAIL_COLUMNS, FIN_COLUMNS = 6, 24, 12, 6  # panels along the chord, and along each span


@dataclass(frozen=True)
class Flap:
    """A control surface at the trailing edge."""

    chord: float = 0.3  # its share of the chord; 1: all of the surface moves
    begin: float = 0.0  # from where along the half span, or the fin's height [of 1]
    end: float = 1.0  # to where

    def __post_init__(self) -> None:
        if not 0.0 < self.chord <= 1.0 or not 0.0 <= self.begin < self.end <= 1.0:
            raise ValueError("'chord' must lie in (0, 1], and 0 <= 'begin' < 'end' <= 1.")


@dataclass(frozen=True)
class LiftingSurface:
    """A trapezoid with a straight quarter chord line; of a fin the span is its height."""

    span: float  # [m]
    root_chord: float  # [m]
    taper: float  # chord at the tip over that at the root [-]
    position: tuple[
        float, float
    ]  # of the root's quarter chord: ahead of the centre of mass, and above it [m]
    flap: Flap  # aileron, elevator or rudder
    sweep_deg: float = 0.0  # of the quarter chord line [deg]
    dihedral_deg: float = 0.0  # [deg]
    incidence_deg: float = 0.0  # of the root's chord to the body's x axis [deg]
    washout_deg: float = 0.0  # of the tip's chord to that of the root [deg]
    zero_lift_deg: float = 0.0  # angle of attack of the profile without lift, negative of cambered ones [deg]

    def __post_init__(self) -> None:
        if min(self.span, self.root_chord) <= 0.0:
            raise ValueError("'span' and 'root_chord' must be greater than 0.")
        if not 0.0 < self.taper <= 1.0:
            raise ValueError(f"'taper' = {self.taper:g} must lie in (0, 1].")
        if max(abs(self.sweep_deg), abs(self.dihedral_deg)) > 60.0:
            raise ValueError("'sweep_deg' and 'dihedral_deg' must lie within ±60.")

    @property
    def area(self) -> float:
        """[m²]."""
        return 0.5 * self.span * self.root_chord * (1.0 + self.taper)

    @property
    def mean_chord(self) -> float:
        """Mean aerodynamic chord [m]."""
        return self.root_chord * 2.0 / 3.0 * (1.0 + self.taper + self.taper**2) / (1.0 + self.taper)


@dataclass(frozen=True)
class Geometry:
    """One aircraft."""

    name: str
    title: str
    like: str  # an aircraft whose file has all that is not said here: servos, motors, sensors
    mass: float  # [kg]
    inertia: tuple[float, ...]  # as in a robot's file [kg·m²]
    speed: float  # of cruise [m/s]
    profile_drag: float  # drag coefficient without lift: a lattice has no friction [-]
    wing: LiftingSurface
    tail: LiftingSurface
    fin: LiftingSurface
    stall_deg: float = 13.0
    kind: Literal["geometry"] = "geometry"

    def __post_init__(self) -> None:
        if min(self.mass, self.speed, self.profile_drag, self.stall_deg) <= 0.0 or len(self.inertia) not in (
            3,
            6,
        ):
            raise ValueError(
                "mass, speed, profile_drag and stall_deg must be greater than 0, and inertia has three or six numbers."
            )

    def meshes(
        self, elevator: float = 0.0, aileron: float = 0.0, rudder: float = 0.0
    ) -> dict[str, np.ndarray]:
        """Corners of the panels of each surface, with flaps deflected, shapes (rows + 1, columns + 1, 3) [m].

        Args:
            elevator: Trailing edge down [rad].
            aileron: Of the left wing down, of the right one up [rad].
            rudder: Trailing edge to the left [rad].
        """
        return {
            "wing": _wing(self.wing, WING_COLUMNS, -aileron, even=False),
            "tail": _wing(self.tail, TAIL_COLUMNS, elevator, even=True),
            "fin": _fin(self.fin, -rudder),
        }


def _chordwise(surface: LiftingSurface, share: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places along the chord from its quarter (rows + 1, columns + 1) [m], and chords (columns + 1,) [m]."""
    chord = surface.root_chord * (1.0 - (1.0 - surface.taper) * share)
    hinge = 1.0 - surface.flap.chord
    rows = np.linspace(0.0, 1.0, ROWS + 1)
    if hinge > 0.0:  # a line of corners lies on the hinge
        behind = min(ROWS - 1, max(1, round(ROWS * surface.flap.chord)))
        rows = np.concatenate(
            (np.linspace(0.0, hinge, ROWS - behind + 1), np.linspace(hinge, 1.0, behind + 1)[1:])
        )
    return (rows[:, None] - 0.25) * chord, chord


def _flapped(surface: LiftingSurface, along: np.ndarray, chord: np.ndarray, share: np.ndarray) -> np.ndarray:
    """How far corners lie behind the hinge of the flap, 0 outside it, shape (rows + 1, columns + 1) [m]."""
    inside = (share >= surface.flap.begin - 1e-9) & (share <= surface.flap.end + 1e-9)
    behind = along - (0.75 - surface.flap.chord) * chord
    return np.where(inside, np.clip(behind, 0.0, None), 0.0)


def _wing(surface: LiftingSurface, columns: int, deflection: float, *, even: bool) -> np.ndarray:
    """Both halves; `deflection`: trailing edge down, on the right, and on the left where it is even, else up [rad]."""
    side = -np.cos(np.linspace(0.0, math.pi, columns + 1))  # -1 at the left tip, 1 at the right one
    side[columns // 2] = 0.0  # the root belongs to neither half
    share = np.abs(side)
    along, chord = _chordwise(surface, share)
    y = 0.5 * surface.span * side
    ahead, up = surface.position
    aft = -ahead + np.tan(math.radians(surface.sweep_deg)) * np.abs(y)
    twist = surface.incidence_deg - surface.zero_lift_deg - surface.washout_deg * share
    down = np.tan(np.deg2rad(twist)) * along  # a nose that is up has its trailing edge down
    sign = 1.0 if even else np.sign(side)
    down = down + np.tan(deflection) * sign * _flapped(surface, along, chord, share)
    height = up + np.tan(math.radians(surface.dihedral_deg)) * np.abs(y) - down
    return np.stack((along + aft, np.broadcast_to(y, along.shape), height), axis=-1)


def _fin(surface: LiftingSurface, deflection: float) -> np.ndarray:
    """From its root up; `deflection`: trailing edge to the right [rad]."""
    share = np.linspace(0.0, 1.0, FIN_COLUMNS + 1)
    along, chord = _chordwise(surface, share)
    z = surface.span * share
    ahead, up = surface.position
    aft = -ahead + math.tan(math.radians(surface.sweep_deg)) * z
    side = np.tan(deflection) * _flapped(surface, along, chord, share)
    return np.stack((along + aft, side, np.broadcast_to(up + z, along.shape)), axis=-1)
