"""Level flight of many aircraft at once, each with a body, a height and air of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fulmar_core.dynamics.flight_dynamics import FlightDynamics, FlightWorld
from fulmar_core.dynamics.rigid_body import inertia_of, turn_acceleration
from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces
from fulmar_core.robots.robot import Robot
from fulmar_core.states.attitude import Quaternion, from_euler, normalised, product, turn
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.spatial import SpatialState

LOWEST = 0.1  # height above the ground that a trim is solved for at least, by the span [-]
ROUNDS = 5  # of Newton's method, which converges quadratically from free air
NUDGE = 1e-6  # of its derivatives [rad, -]
GUESS = 0.03, 0.4  # angle of attack [rad] and throttle that it begins at


class LevelFlight:
    """Trims at cruising speed of many craft at once, each with its own body, height and air; along the world's x.

    Attributes:
        quat: Attitudes, shapes (n,).
        command: Deflections [rad] and throttles, shape (n, m); where there is no trim, the nearest within limits.
    """

    def __init__(self, robot: Robot, world: FlightWorld, height: np.ndarray) -> None:
        """Solve.

        Args:
            robot: An aircraft.
            world: Bodies and air, whose wind is left aside.
            height: Above the ground, shape (n,) [m].
        """
        self._dynamics, self._speed = FlightDynamics(robot, turbulent=False), robot.wings.speed
        self._world = replace(world, wind=0.0 * world.wind)
        self._inertia = inertia_of(tuple(world.inertia))
        self._height = np.maximum(np.nan_to_num(height), LOWEST * robot.wings.span)
        craft = robot.actuated_by(ControlSurfaces)
        self._surfaces, self._motors = craft.positions, len(craft.motors)
        # Without a rudder the sideslip is free, with one it is 0; as in `find_trim`.
        self._angles = 2 if "rudder" in craft.names else 3
        most = [0.5] * self._angles, craft.scale[: self._surfaces], [1.0]
        high = np.concatenate(most)[:, None]
        low = np.concatenate((-high[:-1], [[0.0]]))
        x = np.zeros((len(high), len(height)))
        x[0], x[-1] = GUESS
        for _ in range(ROUNDS):
            x = np.clip(x - self._step(x), low, high)
        self.quat, self.command = self._attitude(x), self._command(x).T

    def _step(self, x: np.ndarray) -> np.ndarray:
        """Newton's step, shape (k, n)."""
        left = self._accelerations(x)
        slopes = [(self._accelerations(x + NUDGE * unit[:, None]) - left) / NUDGE for unit in np.eye(len(x))]
        inverse = np.linalg.pinv(np.stack(slopes, axis=-1).swapaxes(0, 1))
        return np.asarray(np.einsum("nki,in->kn", inverse, left))

    def _attitude(self, x: np.ndarray) -> Quaternion:
        """That of a level path: what turns the velocity in the body onto the world's x, then a roll about that."""
        alpha, roll = x[0], x[1]
        slip = x[2] if self._angles == 3 else 0.0 * roll
        ahead, left, up = np.cos(alpha) * np.cos(slip), -np.sin(slip), -np.sin(alpha) * np.cos(slip)
        zero = 0.0 * roll
        return product(from_euler(roll, zero, zero), normalised((zero, up, -left, 1.0 + ahead)))

    def _command(self, x: np.ndarray) -> np.ndarray:
        """Commands, shape (m, n)."""
        return np.concatenate((x[self._angles : -1], np.repeat(x[-1:], self._motors, axis=0)))

    def _accelerations(self, x: np.ndarray) -> np.ndarray:
        """Linear [m/s²] and turn accelerations [rad/s²], shape (6, n)."""
        zero = 0.0 * self._height
        state = SpatialState(
            zero, zero, self._height, *self._attitude(x), zero + self._speed, *(zero for _ in range(5))
        )
        force, torque = self._dynamics.wrench(state, self._command(x), None, self._world, self._inertia)
        x_, y_, z_ = turn(state.quat, force)
        turned = turn_acceleration(state.rate, torque, self._inertia)
        mass = self._world.mass
        return np.stack((x_ / mass, y_ / mass, z_ / mass - GRAVITY, *turned))
