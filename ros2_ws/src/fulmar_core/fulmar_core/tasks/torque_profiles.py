"""Excitation profiles of satellites: the eight of arXiv 2510.16738 (thesis §6.3, Fig. 6.7), and one of our own.

A profile gives the torque of each motor at a time. Amplitudes are those of the CubeSat; larger satellites have `gain`
times as much. Several ask for more than the wheels have: the motors cut the torque, and the wheels run at top speed.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels

Wave = Callable[
    [np.ndarray], np.ndarray
]  # from times, shape (k,) [s], to torques about x, y, z, shape (k, 3) [N·m]

DURATION_S = 300.0  # of the study's runs
GAINS = {"cubesat_wheels": 1.0, "microsat": 5.0, "smallsat": 9.85}  # of the study's satellites [-]
NOMINAL_TORQUE = 0.01  # of the CubeSat's wheels: others count by theirs [N·m]
SPARE = 0.9  # share of torque and momentum that a profile may take which must not saturate [-]
SWITCH_S = 20.0  # of the pseudorandom binary sequence
OWN = "persistent"  # name of our own profile
# Of our own profile: share of the momentum and of the torque that it uses, and how long each axis stays at an end.
SHARE, PUSH, HOLDS_S = 0.9, 0.95, (5.0, 8.0, 3.0)


@dataclass(frozen=True)
class Profile:
    """Torques of three motors over time."""

    name: str
    wave: Wave
    saturates: bool  # whether wheels reach their top speed or motors their largest torque

    def torque(self, time_s: float | np.ndarray) -> np.ndarray:
        """Torque of each motor, shape (3,) or (k, 3) [N·m]."""
        torques = self.wave(np.atleast_1d(np.asarray(time_s, dtype=float)))
        return torques if np.ndim(time_s) else torques[0]


def _sine(t: np.ndarray) -> np.ndarray:
    return _same(0.01 * np.sin(2.0 * np.pi * 0.01 * t))


def _chirp(t: np.ndarray) -> np.ndarray:
    start, end = 0.005, 0.05
    phase = 2.0 * np.pi * (start * t + 0.5 * (end - start) / DURATION_S * t**2)
    return _same(0.01 * np.sin(phase))


def _prbs(t: np.ndarray, *, seed: int) -> np.ndarray:
    signs = np.random.default_rng(seed).integers(0, 2, (1000, 3)) * 2 - 1
    return np.asarray(0.01 * signs[(t / SWITCH_S).astype(int) % len(signs)])


def _one_step(t: np.ndarray) -> np.ndarray:
    return _same(np.where(t < 100.0, 0.015, 0.0))


def _multi_step(t: np.ndarray) -> np.ndarray:
    signs = np.array([1.0, -1.0, 0.0, 1.0, -1.0, 0.0])
    return _same(0.012 * signs[(t / 50.0).astype(int) % 6])


def _sawtooth(t: np.ndarray) -> np.ndarray:
    return _same(0.02 * (2.0 * ((0.01 * t) % 1.0) - 1.0))


def _multi_sine(t: np.ndarray) -> np.ndarray:
    rows = (
        ((0.002, 0.005), (0.01, 0.007), (0.0, 0.0)),
        ((0.003, 0.007), (0.009, 0.006), (math.pi / 4.0, 0.0)),
        ((0.004, 0.008), (0.008, 0.005), (-math.pi / 3.0, 0.0)),
    )
    return np.stack(
        [
            sum(a * np.sin(2.0 * np.pi * f * t + phase) for f, a, phase in zip(*row, strict=True))
            for row in rows
        ],
        axis=-1,
    )


def _sine_3axis(t: np.ndarray) -> np.ndarray:
    return np.outer(np.sin(2.0 * np.pi * 0.01 * t), (0.03, 0.015, 0.025))


def _same(torque: np.ndarray) -> np.ndarray:
    return np.repeat(torque[:, None], 3, axis=1)


THESIS: dict[str, Callable[..., np.ndarray]] = {
    "sine": _sine,
    "chirp": _chirp,
    "prbs": _prbs,
    "one_step": _one_step,
    "multi_step": _multi_step,
    "sawtooth": _sawtooth,
    "multi_sine": _multi_sine,
    "sine_3axis": _sine_3axis,
}
PROFILES = (*THESIS, OWN)


def profile_of(
    name: str, wheels: ReactionWheels, *, gain: float, seed: int = 0, saturate: bool = False
) -> Profile:
    """A profile for the wheels of a satellite.

    Args:
        name: One of `PROFILES`.
        wheels: Limits of torque and momentum.
        gain: Factor on the amplitudes of the CubeSat; see `gain_of`.
        seed: Of the pseudorandom binary sequence.
        saturate: Whether motors and wheels may reach their limits, as in the study; otherwise all torques are scaled
            down until none does.

    Raises:
        KeyError: There is no such profile.
    """
    if name == OWN:
        return Profile(name, functools.partial(_persistent, wheels=wheels), saturates=False)
    raw = functools.partial(_prbs, seed=seed) if name == "prbs" else THESIS[name]
    times = np.arange(0.0, DURATION_S, 0.1)
    torques = gain * raw(times)
    momentum = np.abs(np.cumsum(0.1 * torques, axis=0)).max()
    excess = max(np.abs(torques).max() / wheels.torque, momentum / wheels.top_momentum)
    scale = gain if saturate else gain * min(1.0, SPARE / excess)
    return Profile(name, lambda t: scale * raw(t), saturates=bool(saturate and excess > 1.0))


def gain_of(robot: str, wheels: ReactionWheels) -> float:
    """Factor on the amplitudes of the CubeSat: that of the study, or the share of its torque."""
    return GAINS.get(robot, wheels.torque / NOMINAL_TORQUE)


def _persistent(t: np.ndarray, *, wheels: ReactionWheels) -> np.ndarray:
    """Trapezoids of momentum between both ends of the wheels, each axis with a period of its own.

    Information about the inertia comes from momenta that change, and, where wheels are large beside the body, far more
    from bodies that turn fast about several axes at once: over a few seconds ω × J ω moves more momentum than a motor.
    So every wheel is at an end of its range whenever it is not on its way to the other one, and the three ways differ
    in length, so that every product of rates comes up. The stays are short, so that an inertia that swings within a
    minute is followed; longer ones have a larger D-criterion (the determinant of the information of all six numbers, a
    second; `fulmar benchmark inertia`), up to 1.4 times that of the study's best profile, and do not.
    """
    columns = []
    torque = PUSH * wheels.torque
    ramp = 2.0 * SHARE * wheels.top_momentum / torque
    for hold in HOLDS_S:
        half = ramp + hold
        phase = (t + 0.5 * ramp) % (2.0 * half)  # it begins at rest, with half a ramp
        up, down = phase < ramp, (phase >= half) & (phase < half + ramp)
        columns.append(torque * (up.astype(float) - down.astype(float)))
    return np.stack(columns, axis=-1)
