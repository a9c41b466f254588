"""Modes of an aircraft about a trim: eigenvalues with the names that flight mechanics gives them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fulmar_core.dynamics.flight_trim import Trim, free_air, still_air
from fulmar_core.dynamics.linear_model import linearise
from fulmar_core.robots.robot import Robot

# Of a departure in space (`linear_model`): position, rotation, velocity and turn rate, three each, y left and z up.
ALONG = (4, 6, 8, 10)  # pitch, speed ahead and up, pitch rate
HEIGHT = (0, 2)  # place ahead and up, which count near the ground
ACROSS = (3, 5, 7, 9, 11)  # roll and heading, speed to the left, roll and yaw rate
SHORT_S, TERMS = 0.001, 6  # of the step that is linearised, and of the series
STILL = 1e-4  # eigenvalues below this are those of coordinates that nothing depends on [1/s]


@dataclass(frozen=True)
class Mode:
    """One mode: a real eigenvalue, or a pair."""

    name: str
    real: float  # [1/s]
    imag: float  # of a pair, > 0; 0 of a real one [rad/s]

    @property
    def frequency(self) -> float:
        """Undamped natural frequency [rad/s]; of a real one the inverse of its time constant."""
        return math.hypot(self.real, self.imag)

    @property
    def damping(self) -> float:
        """Share of critical damping; 1 or −1 of a real one [-]."""
        return -self.real / self.frequency if self.frequency else 0.0

    def as_json(self) -> dict[str, float | str]:
        """As in `fulmar check robot --json`."""
        return {
            "name": self.name,
            "real": self.real,
            "imag": self.imag,
            "frequency": self.frequency,
            "damping": self.damping,
        }


def continuous_model(robot: Robot, trim: Trim) -> tuple[np.ndarray, np.ndarray]:
    """Ẋ = A x + B u of departures from a trim, shapes (12, 12) and (12, n); servos and motors count as at once.

    From the discrete model of a short step, by the series of the logarithm of its joint matrix.
    """
    craft = robot if trim.height is not None else free_air(robot)
    craft = replace(craft, timing=replace(craft.timing, physics_dt=SHORT_S))
    model = linearise(craft, trim.state, trim.command, SHORT_S, partial(still_air, altitude=trim.ground))
    count, inputs = model.b.shape
    step = np.zeros((count + inputs,) * 2)
    step[:count, :count], step[:count, count:] = model.a - np.eye(count), model.b
    power, rates = np.eye(len(step)), np.zeros_like(step)
    for term in range(1, TERMS + 1):
        power = power @ step
        rates += (-1.0) ** (term + 1) / term * power / SHORT_S
    return rates[:count, :count], rates[:count, count:]


def modes_of(robot: Robot, trim: Trim) -> tuple[Mode, ...]:
    """Modes about a trim: short period, phugoid, height near the ground, roll, Dutch roll and spiral."""
    rates, _ = continuous_model(robot, trim)
    along = ALONG if trim.height is None else (*HEIGHT, *ALONG)
    longitudinal = _eigenvalues(rates[np.ix_(along, along)])
    lateral = _eigenvalues(rates[np.ix_(ACROSS, ACROSS)])
    return (*_longitudinal(longitudinal), *_lateral(lateral))


def _eigenvalues(matrix: np.ndarray) -> list[complex]:
    """Eigenvalues with imaginary parts of 0 or more, the largest first; those of ignorable coordinates are left out."""
    values = [complex(value) for value in np.linalg.eigvals(matrix)]
    kept = [value for value in values if abs(value) > STILL and value.imag >= 0.0]
    return sorted(kept, key=abs, reverse=True)


def _longitudinal(values: list[complex]) -> list[Mode]:
    """The two fastest are the short period, the next two the phugoid, and what is left the height."""
    found: list[Mode] = []
    place = 0
    for value in values:
        name = "short period" if place < 2 else "phugoid" if place < 4 else "height"
        found.append(Mode(name, value.real, value.imag))
        place += 2 if value.imag else 1
    return found


def _lateral(values: list[complex]) -> list[Mode]:
    """The faster pair is the Dutch roll, a second one roll and spiral; of real ones the fastest is the roll."""
    pairs = [value for value in values if value.imag]
    reals = [value for value in values if not value.imag]
    found = [Mode("roll" if i == 0 else "spiral", value.real, 0.0) for i, value in enumerate(reals)]
    names = ("Dutch roll", "roll and spiral")
    found += [Mode(names[min(i, 1)], value.real, value.imag) for i, value in enumerate(pairs)]
    return found
