"""Guard of keep-out volumes: a robot in space stops before it, whatever its controller wants.

The guard asks at each control step whether the robot, should it accelerate towards a volume for one more step, could
still stop before it with the weakest push that it has in any direction. Where it could not, the guard's own command
takes the place of the controller's: it brakes, and leaves slowly. Once the gauge of the tank says that the gas left is
what stopping takes, no controller pushes any more: the guard stops the robot, and sends it away where it drifts in.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fulmar_core.controllers.allocation import allocation_of
from fulmar_core.controllers.controller import Inputs
from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.fuel_reserve import FuelReserve, gauges_of
from fulmar_core.states.arrays import side_by_side
from fulmar_core.states.attitude import even_directions, exponential, product, scaled
from fulmar_core.states.rotation import cross, rotate_inverse
from fulmar_core.worlds.structures import KeepOut

MARGIN_M = 0.05  # from the volume, for noise and for what pushes the robot
SHARE = 0.6  # of the weakest push that braking counts on: a part of it turns the body, and valves may be dead
LEAVES_M_S = 0.05  # speed straight away from a volume that a braked robot leaves with
CLEAR_M = 0.05  # beyond the distance of the guard at which the controller acts again
BRAKES_S, STEADIES_S = 0.5, 2.0  # in which it wants to lose a wrong speed, and a turn rate
DIRECTIONS = 200  # of forces that are tried for the weakest
DRIFTS_S = 60.0  # for which the way of a robot with closed valves is looked at
STEP_S = 0.25  # of that look
ENTERED = "in the keep-out volume"  # a part of the words of a robot that is
OUT_OF_FUEL = (
    "the gas left is what stopping takes: the guard stops the robot, and no controller pushes any more"
)
HAD_HELD, HAD_ENTERED = (
    "the keep-out guard held the robot",
    "the robot was in a keep-out volume",
)  # warnings of a run


class KeepOutGuard:
    """Brakes robots of one kind that near volumes; keeps for each of them whether it does so now.

    States are those of bodies in space, shapes (n,).

    Attributes:
        reserve: Of gas for stopping; None of a robot without a tank or without a gauge.
    """

    def __init__(self, robot: Robot, volumes: Sequence[KeepOut], dt: float) -> None:
        """Find out how well the robot brakes.

        Args:
            robot: It has actuators that push.
            volumes: In the world, at least one.
            dt: Time of a control step [s].
        """
        actuators = robot.actuated_by(Pushing)
        body, response = robot.body, robot.actuators.response
        self._volumes, self._mass, self._com = tuple(volumes), body.mass, np.array(body.com)
        self._inertia = body.inertia_matrix
        full = actuators.full_thrust[:, None] * actuators.wrench_per_newton
        most = np.abs(full).sum(axis=0)
        weight = np.diag(1.0 / np.repeat((most[:3].max(), most[3:].max()), 3) ** 2)
        self._allocation = allocation_of(actuators, weight=weight, cost=0.0)
        self._weakest, self._strongest = self._pushes(actuators, most[:3].max())
        self._turn = 0.25 * most[3:].min()  # torque that it steadies the body with, at most [N·m]
        known_s = robot.sensors.odometry.delay_s + response.delay_s + response.opening_delay_s
        self._late_s = known_s + dt  # of the answer to what is measured next
        self._middle_s = known_s + 0.5 * dt  # from the measurement to the middle of the command's time
        self._safe = np.asarray(robot.actuators.safe_command, dtype=float)
        self.reserve: FuelReserve | None = None
        if gauges_of(robot):
            self.reserve = FuelReserve(robot, self._allocation, self._weakest, self._turn, self._late_s)
        self._holds = np.zeros(1, dtype=bool)

    def _pushes(self, actuators: Pushing, force: float) -> tuple[float, float]:
        """Weakest and strongest force without torque, over all directions [N]."""
        ways = even_directions(DIRECTIONS)
        wanted = np.concatenate((force * ways, np.zeros_like(ways)), axis=1)
        wanted[:, 3:] += cross(self._com, wanted[:, :3])
        made, _ = actuators.wrench_in_body(self._allocation.best(wanted))
        along = np.sum(made * ways, axis=1)
        return float(along.min()), float(along.max())

    def reset(self) -> None:
        """Brake no robot: a new episode, or a jump."""
        self._holds[:] = False
        if self.reserve is not None:
            self.reserve.reset()

    def holds(self, state: Any) -> np.ndarray:
        """Which robots the guard brakes now, shape (n,); a robot that it brakes is let go once it leaves.

        Args:
            state: As measured, shapes (n,).
        """
        place, velocity = _rows(state.position), _rows(state.velocity)
        if len(self._holds) != len(place):
            self._holds = np.zeros(len(place), dtype=bool)
        push, most = SHARE * self._weakest / self._mass, self._strongest / self._mass
        near = np.full(len(place), np.inf)
        for volume in self._volumes:
            away, far = volume.offset(place)
            nears = -np.sum(velocity * away, axis=-1) + most * self._late_s  # after one more step
            left = far - nears.clip(0.0) * self._late_s
            near = np.minimum(near, left - nears.clip(0.0) ** 2 / (2.0 * push))
        self._holds = (near < MARGIN_M) | (self._holds & (near < MARGIN_M + CLEAR_M))
        return self._holds

    def drifts_in(self, state: Any) -> bool:
        """Whether the first robot would enter a volume within a minute if nothing pushed it."""
        place, velocity = _rows(state.position)[:1], _rows(state.velocity)[:1]
        return bool(np.isfinite(drift_enters_s(self._volumes, place, velocity))[0])

    def brake(
        self, state: Any, alive: np.ndarray | None = None, leaves: np.ndarray | None = None
    ) -> np.ndarray:
        """Commands that stop robots before the nearest volume, and let them leave it slowly, shape (n, m).

        Args:
            state: As measured, shapes (n,).
            alive: 0 for actuators that are believed dead, else 1, shape (n, m); None: not known.
            leaves: Which leave it, the others only being stopped, shape (n,); None: all.
        """
        place = _rows(state.position)
        turned = scaled(self._middle_s, state.rate)  # a body that spins pushes the other way a moment later
        quat = _rows(product(state.quat, exponential(turned)))
        away, far = self._volumes[0].offset(place)
        for volume in self._volumes[1:]:
            other, its = volume.offset(place)
            away, far = np.where((its < far)[:, None], other, away), np.minimum(its, far)
        speed = LEAVES_M_S if leaves is None else LEAVES_M_S * leaves[:, None]
        missing = speed * away - _rows(state.velocity)
        force = _limited(self._mass / BRAKES_S * rotate_inverse(quat, missing), self._weakest)
        rate = _rows(state.rate)
        # No more than the actuators have beside the force, at any rate: no gyroscopic torque is made up for.
        torque = _limited(-(rate @ self._inertia) / STEADIES_S, self._turn)
        wrench = np.concatenate((force, torque + cross(self._com, force)), axis=-1)
        return np.asarray(self._allocation.best(wrench, alive))

    def guarded(self, command: np.ndarray, inputs: Inputs) -> np.ndarray:
        """Commands of a controller, or the guard's own for robots that it brakes, shape (n, m)."""
        leaves, stops = self.holds(inputs.state), np.zeros(len(command), dtype=bool)
        if self.reserve is not None:
            spent = self.reserve.watch(inputs)
            if spent.any():
                place, velocity = _rows(inputs.state.position), _rows(inputs.state.velocity)
                command = np.where(spent[:, None], self._safe, command)
                leaves = leaves | (spent & np.isfinite(drift_enters_s(self._volumes, place, velocity)))
                stops = spent & (np.linalg.norm(velocity, axis=-1) > LEAVES_M_S)
        acts = leaves | stops
        if not acts.any():
            return command
        alive = None if inputs.estimates is None else inputs.estimates.alive
        return np.where(acts[:, None], self.brake(inputs.state, alive, leaves), command)

    def words(self, state: Any, names: Sequence[str]) -> str:
        """Why the first robot is held, or that it is where it must not be; empty if neither.

        Args:
            state: As measured, shapes (n,).
            names: Of the things that the volumes are about.
        """
        place, velocity = _rows(state.position)[:1], _rows(state.velocity)[:1]
        found = [volume.offset(place) for volume in self._volumes]
        nearest = int(np.argmin([far[0] for _, far in found]))
        away, far = found[nearest][0][0], float(found[nearest][1][0])
        if far < 0.0:
            return f"{-far:.2f} m {ENTERED} of '{names[nearest]}': the guard pushes the robot out"
        if self.reserve is not None and self.reserve.spent[0]:
            return OUT_OF_FUEL
        if not self._holds[0]:
            return ""
        nears = -float(velocity[0] @ away)
        moves = f"nears with {nears:.2f} m/s" if nears > 0.0 else f"leaves with {-nears:.2f} m/s"
        return f"{far:.2f} m from the keep-out volume of '{names[nearest]}', {moves}: the guard brakes"


def drift_enters_s(volumes: Sequence[KeepOut], place: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """When bodies that nothing pushes any more enter a volume, NaN where they do not within a minute.

    Args:
        volumes: In the world.
        place: Shape (n, 3) [m].
        velocity: In the world, shape (n, 3) [m/s].

    Returns:
        Shape (n,) [s].
    """
    times = np.arange(0.0, DRIFTS_S + STEP_S / 2, STEP_S)
    way = place[:, None] + times[:, None] * velocity[:, None]  # (n, times, 3)
    inside = np.zeros(way.shape[:2], dtype=bool)
    for volume in volumes:
        inside |= volume.distance(way) < 0.0
    return np.where(inside.any(axis=1), times[np.argmax(inside, axis=1)], np.nan)


def _rows(parts: tuple[np.ndarray, ...]) -> np.ndarray:
    return np.asarray(side_by_side(*parts))


def _limited(vectors: np.ndarray, most: float) -> np.ndarray:
    """Vectors (n, 3) no longer than that."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors * np.minimum(1.0, most / np.maximum(length, 1e-12)))
