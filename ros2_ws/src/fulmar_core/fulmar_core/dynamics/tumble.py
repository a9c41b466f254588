"""The torque-free tumble of an asymmetric body: what the step of `rigid_body` drifts by, and the closed form beside it.

Energy and angular momentum of a body without torque stay what they are, and Jacobi's elliptic functions say how its
turn rate changes (Landau, Lifshitz, Mechanics, §37).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.dynamics.rigid_body import (
    Inertia,
    angular_momentum_in_world,
    inertia_of,
    kinetic_energy,
    rigid_body_step,
)
from fulmar_core.states.spatial import SpatialState

MOMENTS = (1.0, 2.0, 3.0)  # of the body [kg·m²]
RATE = 0.3  # length of the turn rate at the start [rad/s]
AXIS = (1.0, 0.0, 1.2)  # its direction in the body: nothing about the middle axis, as `jacobi_rate` asks
MASS = 1.0  # [kg]
CHECK_S = 60.0  # time between two looks at what has drifted [s]
ORDER_STEPS_S = (
    0.8,
    0.4,
    0.2,
    0.02,
)  # steps whose errors give the order; the last one stands for the exact motion
ORDER_S = 20.0  # time over which they are compared [s]


@dataclass(frozen=True)
class Drift:
    """The largest drifts of a tumble, over all looks at it."""

    energy: float  # relative [-]
    momentum: float  # change of the angular momentum in the world, relative [-]
    from_jacobi: float  # of the turn rate, relative to its first length [-]


def tumbling(axis: Any = AXIS, like: Any = np.float64) -> SpatialState:
    """A body at the origin that only turns, `RATE` fast; columns of one floating type."""
    rate = np.asarray(axis, dtype=float) * (RATE / np.linalg.norm(axis))
    return SpatialState(*(like(value) for value in (0.0,) * 6 + (1.0,) + (0.0,) * 3 + tuple(rate)))


def asymmetric_body(like: Any = np.float64) -> Inertia:
    """The body of three different moments."""
    return inertia_of(tuple(like(moment) for moment in MOMENTS))


def torque_free(state: SpatialState, body: Inertia, seconds: float, dt: float) -> SpatialState:
    """The state later, `dt` a step, both in seconds."""
    zero = (0.0 * state.wx,) * 3
    mass = zero[0] + MASS
    for _ in range(round(seconds / dt)):
        state = rigid_body_step(state, zero, zero, None, mass, body, dt)
    return state


def drifts(start: SpatialState, end: SpatialState, body: Inertia) -> tuple[float, float]:
    """Relative changes of energy and of angular momentum."""
    energy = kinetic_energy(end, MASS, body) / kinetic_energy(start, MASS, body) - 1.0
    before, now = (np.array(angular_momentum_in_world(state, body)) for state in (start, end))
    return float(abs(energy)), float(np.linalg.norm(now - before) / np.linalg.norm(before))


def jacobi_rate(rate: Any, seconds: float) -> np.ndarray:
    """Turn rate of the body later, shape (3,) [rad/s].

    Args:
        rate: At the start, without a part about the middle axis [rad/s].
        seconds: How much later [s].
    """
    from scipy.special import ellipj

    (i1, i2, i3), (a, _, c) = MOMENTS, (float(part) for part in rate)
    frequency = c * math.sqrt((i3 - i2) * (i3 - i1) / (i1 * i2))
    parameter = a**2 * i1 * (i2 - i1) / (c**2 * i3 * (i3 - i2))
    sn, cn, dn, _ = ellipj(frequency * seconds, parameter)
    return np.array([a * cn, a * math.sqrt(i1 * (i3 - i1) / (i2 * (i3 - i2))) * sn, c * dn])


def drift_over(
    seconds: float, dt: float, like: Any = np.float64, progress: Callable[[float], None] = lambda done: None
) -> Drift:
    """Let the body tumble, and look at it every minute and in the end.

    Args:
        seconds: How long [s].
        dt: Integration step [s].
        like: Floating type of the integration; drifts are computed in float64.
        progress: Called with the time that has passed [s].
    """
    state, body, exact = tumbling(like=like), asymmetric_body(like), asymmetric_body()
    first, found, time_s = state.in_float64(), np.zeros(3), 0.0
    while time_s < seconds - 0.5 * dt:
        stretch = dt * max(1, round(min(CHECK_S, seconds - time_s) / dt))
        state = torque_free(state, body, stretch, dt)
        time_s += stretch
        now = state.in_float64()
        away = np.linalg.norm(np.array(now.rate) - jacobi_rate(first.rate, time_s)) / RATE
        found = np.maximum(found, np.array((*drifts(first, now, exact), float(away))))
        progress(time_s)
    return Drift(*(float(value) for value in found))


def measured_order() -> float:
    """Order of the step in attitude and turn rate, from halved steps: the smaller of two estimates."""
    start, body = tumbling((1.0, 0.4, 1.2)), asymmetric_body()
    *coarse, exact = (
        np.array(torque_free(start, body, ORDER_S, dt).columns(), dtype=float) for dt in ORDER_STEPS_S
    )
    errors = [float(np.abs(columns - exact).max()) for columns in coarse]
    return min(math.log2(more / less) for more, less in itertools.pairwise(errors))
