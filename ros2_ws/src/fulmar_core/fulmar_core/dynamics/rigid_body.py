"""A rigid body in space under forces and torques.

One step is of fourth order in the rotation: Runge-Kutta for Euler's equation of the turn rate, and the Magnus expansion
for the attitude, which stays a unit quaternion by construction. Force and torque are held over the step, in the body's
frame for actuators and in the world's for the surroundings; the path of the centre of mass is of second order, exact
for a force that does not turn.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.states.attitude import (
    Tensor,
    Vector,
    cross,
    dot,
    exponential,
    minus,
    normalised,
    plus,
    product,
    scaled,
    times,
    turn,
)
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState


@dataclass(frozen=True, slots=True)
class Inertia:
    """Inertia tensor about the centre of mass in the body's frame, and its inverse."""

    tensor: Tensor  # [kg·m²]
    inverse: Tensor  # [1/(kg·m²)]

    def scaled(self, share: Array) -> Inertia:
        """Of a body that kept a share of its mass in the same shape, shape (...,)."""
        return Inertia(
            tuple(share * entry for entry in self.tensor), tuple(entry / share for entry in self.inverse)
        )


def inertia_of(tensor: Tensor) -> Inertia:
    """Inertia with its inverse, by cofactors; the tensor is positive definite [kg·m²]."""
    if len(tensor) == 3:
        return Inertia(tensor, tuple(1.0 / entry for entry in tensor))
    xx, yy, zz, xy, xz, yz = tensor
    a, b, c = yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy
    d, e, f = xz * yz - xy * zz, xy * yz - xz * yy, xy * xz - xx * yz
    share = 1.0 / (xx * a + xy * d + xz * e)
    return Inertia(tensor, tuple(share * entry for entry in (a, b, c, d, e, f)))


def matrix_of(tensor: Any) -> np.ndarray:
    """Inertia tensor of its entries xx, yy, zz, xy, xz, yz as a matrix, shape (3, 3) [kg·m²]."""
    xx, yy, zz, xy, xz, yz = np.asarray(tensor, dtype=float)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def turn_acceleration(rate: Vector, torque: Vector, inertia: Inertia) -> Vector:
    """Euler's equation: J⁻¹ (τ − ω × J ω).

    Args:
        rate: ω about the body's axes [rad/s].
        torque: τ about the centre of mass, same axes [N·m].
        inertia: J.

    Returns:
        Same axes [rad/s²].
    """
    return times(inertia.inverse, minus(torque, cross(rate, times(inertia.tensor, rate))))


def rigid_body_step(
    state: SpatialState,
    force: Vector,
    torque: Vector,
    force_in_world: Vector | None,
    mass: Array,
    inertia: Inertia,
    dt: float,
) -> SpatialState:
    """Move the centre of mass through one integration step.

    Args:
        state: Of the centre of mass; all arrays of one floating type.
        force: In the body's frame [N].
        torque: In the body's frame about the centre of mass [N·m].
        force_in_world: By the surroundings [N]; None: nothing.
        mass: Shape (...,) [kg].
        inertia: Of the body.
        dt: Integration step, > 0 [s].

    Returns:
        State after `dt`.
    """
    w, half = state.rate, 0.5 * dt
    k1 = turn_acceleration(w, torque, inertia)
    k2 = turn_acceleration(_moved(w, half, k1), torque, inertia)
    k3 = turn_acceleration(_moved(w, half, k2), torque, inertia)
    k4 = turn_acceleration(_moved(w, dt, k3), torque, inertia)
    sixth, third = dt / 6.0, dt / 3.0
    x, y, z = (w[i] + sixth * (k1[i] + k4[i]) + third * (k2[i] + k3[i]) for i in range(3))
    after = x, y, z
    end = turn_acceleration(after, torque, inertia)
    return turned(state, after, k1, end, force, force_in_world, mass, dt)


def turned(
    state: SpatialState,
    after: Vector,
    begin: Vector,
    end: Vector,
    force: Vector | None,
    force_in_world: Vector | None,
    mass: Array,
    dt: float,
) -> SpatialState:
    """State after a step whose change of the turn rate is known.

    Args:
        state: Before it.
        after: Turn rate after it [rad/s].
        begin: Turn acceleration at its begin [rad/s²].
        end: Same at its end.
        force: As in `rigid_body_step`; None: nothing.
        force_in_world: Same.
        mass: Same.
        dt: Same.
    """
    w, half, sixth = state.rate, 0.5 * dt, dt / 6.0
    # Hermite's midpoint of the rate, then the fourth-order Magnus expansion in the body's frame (Hairer, Lubich and
    # Wanner, Geometric Numerical Integration, 2006, §IV.7).
    bend = scaled(0.125 * dt, minus(begin, end))
    swing = scaled(dt * dt / 12.0, cross(w, after))
    x, y, z = (half * (w[i] + after[i]) + (4.0 * sixth) * bend[i] + swing[i] for i in range(3))
    rotation = x, y, z
    quat = normalised(product(state.quat, exponential(rotation)))
    push = force_in_world
    if force is not None:
        # Half of the rotation stands for the attitude in the middle of the step.
        push = turn(product(state.quat, exponential(scaled(0.5, rotation))), force)
        if force_in_world is not None:
            push = plus(push, force_in_world)
    if push is None:
        return SpatialState(*_moved(state.position, dt, state.velocity), *quat, *state.velocity, *after)
    gain = scaled(dt / mass, push)
    position = _moved(state.position, dt, _moved(state.velocity, 0.5, gain))
    return SpatialState(*position, *quat, *plus(state.velocity, gain), *after)


def _moved(place: Vector, seconds: float, rate: Vector) -> Vector:
    return place[0] + seconds * rate[0], place[1] + seconds * rate[1], place[2] + seconds * rate[2]


def shifted(state: SpatialState, arm: Vector) -> SpatialState:
    """State of another point of the same body: of its centre of mass from that of its origin, say.

    Args:
        state: Of one point.
        arm: From it to the other, in the body's frame [m].
    """
    position = plus(state.position, turn(state.quat, arm))
    velocity = plus(state.velocity, turn(state.quat, cross(state.rate, arm)))
    return SpatialState(*position, *state.quat, *velocity, *state.rate)


def kinetic_energy(state: SpatialState, mass: Array, inertia: Inertia) -> Array:
    """Of motion and rotation, shape (...,) [J]."""
    v, w = state.velocity, state.rate
    return 0.5 * (mass * dot(v, v) + dot(w, times(inertia.tensor, w)))


def angular_momentum_in_world(state: SpatialState, inertia: Inertia) -> Vector:
    """About the centre of mass [N·m·s]."""
    return turn(state.quat, times(inertia.tensor, state.rate))
