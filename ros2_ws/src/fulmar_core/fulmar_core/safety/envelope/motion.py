"""How bodies move under a command, for the sums of the envelope guard.

A decision for one robot is made of short sums, on which the overhead of arrays costs ten times the arithmetic. Here
these are done in plain numbers, with the same bits as for many robots side by side.
"""

from __future__ import annotations

import numpy as np

from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.robots.robot import Robot
from fulmar_core.states.attitude import cross as cross_of
from fulmar_core.states.attitude import exponential, product
from fulmar_core.states.rotation import cross, rotate, rotate_inverse, turned
from fulmar_core.states.state import RigidBodyState

REMEMBERED = 256  # commands whose wrenches are not computed again


class Motion:
    """Motion of bodies of one kind.

    Attributes:
        mass: Of each [kg].
        turning: Inverse of the inertia, shape (3, 3) [1/(kg·m²)]; of a body in the plane about its z axis alone.
    """

    def __init__(self, robot: Robot) -> None:
        """Take what pushes and what is pushed."""
        body = robot.body
        self._actuators, self._com = robot.actuated_by(Pushing), np.array(body.com)
        self._known: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}
        self.mass = body.mass
        self.turning = np.linalg.inv(body.inertia_matrix)
        if robot.state_type.AXES == 2:
            self.turning = np.diag((0.0, 0.0, 1.0 / body.inertia[2]))

    def wrench(self, command: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Force and moment in the body's frame, shapes (n, 3) [N, N·m], of commands, shape (n, m).

        Those of one robot are remembered, as valves know few commands.
        """
        if len(command) != 1:
            return self._of(command)
        key = command.tobytes()
        found = self._known.get(key)
        if found is None:
            if len(self._known) >= REMEMBERED:
                self._known.clear()
            found = self._known[key] = self._of(command)
        return found

    def _of(self, command: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        force, torque = self._actuators.wrench_in_body(command)
        return force, torque - cross(self._com, force)

    def after(self, now: RigidBodyState, command: np.ndarray, seconds: np.ndarray | float) -> RigidBodyState:
        """State once a command has acted for some time.

        Args:
            now: State of n bodies.
            command: Shape (n, m).
            seconds: How long, shape (n, 1) or one number [s].
        """
        rate = now.angular_velocity_in_body
        middle = attitude_after(now.quat_xyzw, 0.5 * seconds * rate)
        place, velocity, later = self.moved(now, middle, command, seconds)
        quat = attitude_after(now.quat_xyzw, 0.5 * seconds * (rate + later))
        return RigidBodyState(place, quat, velocity, later)

    def moved(
        self, now: RigidBodyState, middle: np.ndarray, command: np.ndarray, seconds: np.ndarray | float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position, velocity and turn rate of `after`, shapes (n, 3) [m], [m/s], [rad/s].

        Args:
            now: See `after`.
            middle: Attitude half-way, shape (n, 4).
            command: See `after`.
            seconds: See `after`.
        """
        force, moment = self.wrench(command)
        push = in_world(middle, force) * (seconds / self.mass)
        velocity = now.velocity_in_world
        return (
            now.position_in_world + seconds * (velocity + 0.5 * push),
            velocity + push,
            now.angular_velocity_in_body + seconds * (moment @ self.turning),
        )


def attitude_after(quat: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Attitude of bodies once they have turned, shape (n, 4).

    Args:
        quat: Attitude at the beginning, shape (n, 4).
        angle: Rotation vector in the body's frame, shape (n, 3) [rad].
    """
    if len(angle) == 1:
        x, y, z = angle[0].tolist()
        a, b, c, d = quat[0].tolist()
        return np.array([product((a, b, c, d), exponential((x, y, z)))])
    return np.stack(product(tuple(quat.T), exponential(tuple(angle.T))), axis=-1)


def in_world(quat: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Vectors of the body in the world, shape (n, 3), for attitudes of shape (n, 4)."""
    if len(quat) == 1:
        return np.array([turned(quat[0].tolist(), vector[0].tolist())])
    return np.asarray(rotate(quat, vector))


def in_body(quat: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Vectors of the world in the body, shapes as in `in_world`."""
    if len(quat) == 1:
        x, y, z, w = quat[0].tolist()
        return np.array([turned((x, y, z, -w), vector[0].tolist())])
    return np.asarray(rotate_inverse(quat, vector))


def crossed(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross product, shapes (n, 3)."""
    if len(a) == 1:
        return np.array([cross_of(tuple(a[0].tolist()), tuple(b[0].tolist()))])
    return np.asarray(cross(a, b))


def lengths(vectors: np.ndarray) -> np.ndarray:
    """Length of each, shape (n, 3) to (n,)."""
    return np.asarray(np.sqrt((vectors * vectors).sum(axis=1)))
