"""Model of a family of robots for a fit: its unknowns, and the poses that they predict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.states.counter_rng import Draws
from fulmar_core.worlds.scenario import Scenario, draw_world
from fulmar_core.worlds.world import FIELDS, World
from fulmar_evaluation.identification.drives import Windows

USEFUL_DELAY_S, USEFUL_PLACE_M = 0.1, 0.1  # a worse one helps no simulation
IN_PLANE, PLANE_CHANNELS = (0, 0, 1), ("x_m", "y_m", "heading_rad")  # of models in the plane
Values = Mapping[str, np.ndarray]  # each unknown in its own unit, shape (copies, 1)


@dataclass(frozen=True)
class Unknown:
    """One number to estimate."""

    name: str
    start: float  # where the search begins; the nominal value
    unit: str
    positive: bool = True  # searched by its logarithm: it has a size, and so has its relative error
    scale: float = 1.0  # its usual size, for one that may be 0 or less
    useful: float = 0.0  # half of the widest interval that is of use, for one that may be 0 or less
    blur: float = 0.0  # standard deviation of what the model itself errs by, in the unknown's unit

    def to_search(self, value: float) -> float:
        """The number that the fit works with."""
        return float(np.log(value)) if self.positive else value / self.scale

    def from_search(self, place: np.ndarray) -> np.ndarray:
        """Values of such numbers."""
        return np.exp(place) if self.positive else place * self.scale


@dataclass(frozen=True)
class Known:
    """A number that was measured otherwise: by weighing, from a data sheet."""

    name: str  # of an unknown
    value: float
    std: float  # standard deviation of its error, > 0


class Model(Protocol):
    """One family of robots.

    Attributes:
        unknowns: The same for all windows.
        kinds: Of each channel of a pose: 0 for a length, 1 for an angle.
        channels: Their names, with units.
        own: How many numbers each window has for itself: its first state, and what pushes during it.
        spans_s: Lengths of windows, from the first fit to the last one: short ones find their way from far off.
    """

    unknowns: tuple[Unknown, ...]
    kinds: tuple[int, ...]
    channels: tuple[str, ...]
    own: int
    spans_s: tuple[float, ...]

    def predict(self, values: Values, own: np.ndarray, windows: Windows) -> np.ndarray:
        """Poses at all grid points.

        Args:
            values: The unknowns.
            own: Each window's own numbers, of which the first are its first state, shape (own, copies, windows).
            windows: Their commands and times.

        Returns:
            Shape (steps + 1, channels, copies, windows), as in `drives.Drive.pose`.
        """
        ...

    def own_of(self, states: np.ndarray) -> np.ndarray:
        """Each window's own numbers to begin with, shape (own, w), from its first state, `Windows.first_states`."""
        ...


class PushedModel:
    """What models of bodies that something pushes in the plane have in common."""

    kinds: tuple[int, ...] = IN_PLANE
    channels: tuple[str, ...] = PLANE_CHANNELS
    own = 9  # six of the state; a constant push along the world's x and y [m/s²] (wind, slope) and in yaw [rad/s²]

    def own_of(self, states: np.ndarray) -> np.ndarray:
        """See `Model.own_of`."""
        return np.concatenate((states, np.zeros((3, states.shape[1]))))


def nominal_world(robot: Robot, **instead: np.ndarray) -> World:
    """A still world around the nominal robot; arrays in `instead` take the place of nominal values."""
    calm = Scenario("calm", sensor_noise=False, body="nominal")
    nominal = draw_world(robot, calm, Draws(0, np.zeros(1), np.zeros(1)))
    return World(*(instead.get(name, getattr(nominal, name)) for name in FIELDS))
