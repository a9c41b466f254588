"""Newton and Euler for one rigid body, integrated semi-implicitly.

Semi-implicit Euler (new velocity, then new position with it) is what MuJoCo's Euler integrator does, so
both simulators agree to rounding when they are given the same forces.
"""

from __future__ import annotations

from dataclasses import dataclass

from array_api_compat import array_namespace, device

from fulmar_core.rotation import Array, cross, from_rotation_vector, multiply, rotate, rotate_inverse
from fulmar_core.state import RigidBodyState


@dataclass(frozen=True, slots=True)
class MassProperties:
    """Mass and inertia of one body, or of many at once."""

    mass: Array  # (..., 1) [kg]
    inertia: Array  # (..., 3) principal moments about the body axes [kg·m²]


@dataclass(frozen=True, slots=True)
class Disturbance:
    """Wrench from outside, constant over one control step."""

    force_in_world: Array  # (..., 3) [N]
    torque_in_world: Array  # (..., 3) [N·m]


def step(
    state: RigidBodyState,
    force_in_body: Array,
    torque_in_body: Array,
    *,
    body: MassProperties,
    disturbance: Disturbance,
    planar: bool,
    dt: float,
    substeps: int = 1,
) -> RigidBodyState:
    """Move a body under a wrench that is constant in its own frame.

    Args:
        state: Where the body is; all arrays of one floating type.
        force_in_body: Shape (..., 3) [N].
        torque_in_body: Shape (..., 3) [N·m].
        body: Mass properties.
        disturbance: Wrench from outside, constant in the world frame.
        planar: Suppress motion along z and about x and y.
        dt: Integration step, > 0 [s].
        substeps: Number of integration steps, >= 1.

    Returns:
        State after `dt * substeps`.
    """
    xp = array_namespace(force_in_body)
    acceleration_from_outside = disturbance.force_in_world / body.mass
    specific_force = force_in_body / body.mass
    position, quat = state.position_in_world, state.quat_xyzw
    velocity, omega = state.velocity_in_world, state.angular_velocity_in_body
    if planar:
        kind = {"dtype": force_in_body.dtype, "device": device(force_in_body)}
        in_plane = xp.asarray([1.0, 1.0, 0.0], **kind)
        about_z = xp.asarray([0.0, 0.0, 1.0], **kind)
        acceleration_from_outside = acceleration_from_outside * in_plane
        specific_force = specific_force * in_plane
        angular_acceleration = about_z * (torque_in_body + disturbance.torque_in_world) / body.inertia
    for _ in range(substeps):
        if not planar:
            torque = torque_in_body + rotate_inverse(quat, disturbance.torque_in_world)
            angular_acceleration = (torque - cross(omega, body.inertia * omega)) / body.inertia
        velocity = velocity + dt * (rotate(quat, specific_force) + acceleration_from_outside)
        omega = omega + dt * angular_acceleration
        position = position + dt * velocity
        quat = multiply(quat, from_rotation_vector(dt * omega))
    norm = xp.sqrt(xp.sum(quat * quat, axis=-1, keepdims=True))
    return RigidBodyState(position, quat / norm, velocity, omega)
