"""A rigid body with reaction wheels: a gyrostat.

With J the inertia tensor of the whole spacecraft, wheels locked, J_s the spin inertia of each wheel about its axis a_i,
Ω_i the speed of a wheel relative to the body and τ_i the torque on it (Markley and Crassidis, Fundamentals of
Spacecraft Attitude Determination and Control, 2014, §3.3.5):

    (J − J_s Σ a_i a_iᵀ) ω̇ = τ − Σ a_i τ_i − ω × (J ω + J_s Σ a_i Ω_i)
    Ω̇_i = τ_i / J_s − a_i · ω̇

The thesis and arXiv 2510.16738 leave out J_s on the left and a_i · ω̇, which differ from this by J_s / J.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fulmar_core.dynamics.rigid_body import Inertia, inertia_of, turned
from fulmar_core.states.arrays import sum_of
from fulmar_core.states.attitude import Tensor, Vector, cross, minus, plus, times
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState

Speeds = tuple[Array, ...]  # one array of shape (...,) for each wheel


@dataclass(frozen=True)
class Flywheels:
    """The wheels of a body: axes that are fixed to it, and one spin inertia."""

    axes: np.ndarray  # unit vectors in the body frame, shape (n, 3)
    spin_inertia: float  # of each about its axis [kg·m²]

    def momentum(self, speeds: Speeds) -> Vector:
        """Momentum of the wheels relative to the body, in the body frame [N·m·s]."""
        return self.vector(tuple(self.spin_inertia * speed for speed in speeds))

    def vector(self, parts: Speeds) -> Vector:
        """Sum of vectors along the axes, in the body frame."""
        x, y, z = (
            sum_of([float(a) * part for a, part in zip(column, parts, strict=True)]) for column in self.axes.T
        )
        return x, y, z

    def along(self, vector: Vector) -> Speeds:
        """Parts of a vector of the body frame along each axis."""
        return tuple(
            sum_of([float(a) * part for a, part in zip(axis, vector, strict=True)]) for axis in self.axes
        )

    def without(self, tensor: Tensor) -> Inertia:
        """Inertia that the motors accelerate: of the spacecraft, less what its wheels have about their axes."""
        share = self.spin_inertia * self.axes.T @ self.axes
        extra = share[0, 1], share[0, 2], share[1, 2]
        if len(tensor) == 3 and not any(extra):
            return inertia_of(tuple(entry - float(share[i, i]) for i, entry in enumerate(tensor)))
        whole = (*tensor, *((0.0 * tensor[0],) * 3))[:6]
        parts = (share[0, 0], share[1, 1], share[2, 2], *extra)
        return inertia_of(tuple(entry - float(part) for entry, part in zip(whole, parts, strict=True)))


def gyrostat_step(
    state: SpatialState,
    speeds: Speeds,
    torque: Vector,
    force_in_world: Vector | None,
    wheel_torques: Callable[[Speeds], Speeds],
    wheels: Flywheels,
    mass: Array,
    tensor: Tensor,
    dt: float,
) -> tuple[SpatialState, Speeds]:
    """Move a body and its wheels through one integration step, of fourth order.

    Args:
        state: Of the centre of mass; all arrays of one floating type.
        speeds: Of the wheels relative to the body [rad/s].
        torque: On the body from outside, about the centre of mass in the body's frame [N·m].
        force_in_world: By the surroundings [N]; None: nothing.
        wheel_torques: Torque on each wheel at given speeds [N·m].
        wheels: Axes and spin inertia.
        mass: Shape (...,) [kg].
        tensor: Inertia of the whole spacecraft about its centre of mass, wheels locked [kg·m²].
        dt: Integration step, > 0 [s].

    Returns:
        State and speeds after `dt`.
    """
    light = wheels.without(tensor)

    def slopes(rate: Vector, spins: Speeds) -> tuple[Vector, Speeds]:
        pulls = wheel_torques(spins)
        momentum = plus(times(tensor, rate), wheels.momentum(spins))
        turning = times(light.inverse, minus(minus(torque, wheels.vector(pulls)), cross(rate, momentum)))
        along = wheels.along(turning)
        return turning, tuple(
            pull / wheels.spin_inertia - part for pull, part in zip(pulls, along, strict=True)
        )

    rate, half = state.rate, 0.5 * dt
    k1, s1 = slopes(rate, speeds)
    k2, s2 = slopes(_moved3(rate, half, k1), _moved(speeds, half, s1))
    k3, s3 = slopes(_moved3(rate, half, k2), _moved(speeds, half, s2))
    k4, s4 = slopes(_moved3(rate, dt, k3), _moved(speeds, dt, s3))
    sixth, third = dt / 6.0, dt / 3.0
    after = _moved3(_moved3(rate, sixth, plus(k1, k4)), third, plus(k2, k3))
    spun = tuple(
        each + sixth * (a + d) + third * (b + c)
        for each, a, b, c, d in zip(speeds, s1, s2, s3, s4, strict=True)
    )
    end, _ = slopes(after, spun)
    return turned(state, after, k1, end, None, force_in_world, mass, dt), spun


def _moved(values: Speeds, seconds: float, slopes: Speeds) -> Speeds:
    return tuple(value + seconds * slope for value, slope in zip(values, slopes, strict=True))


def _moved3(values: Vector, seconds: float, slopes: Vector) -> Vector:
    x, y, z = _moved(values, seconds, slopes)
    return x, y, z
