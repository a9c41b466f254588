"""Worlds whose bodies differ: mass, inertia, and where and how strongly thrusters push, drawn for each episode."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from fulmar_core.robots.actuators.thrusters import Thrusters
from fulmar_core.robots.morphology import Morphology
from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import clip, sum_of
from fulmar_core.states.attitude import Vector
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.rotation import Array
from fulmar_core.worlds.spatial_world import SpatialWorld

BRANCH = 2  # of the draws of a world
TRIES = 8  # bodies that are drawn for an episode; the first that can be flown is taken, else the robot's own
LEAST_RATIO = 0.3  # of the smallest singular value of the effect to the largest, torques by the mean arm [-]
LEAST_RESTING = (
    0.1  # opening of each thruster, all open alike and what that makes undone by the least change [-]
)


@dataclass(frozen=True, slots=True)
class ShapedWorld(SpatialWorld):
    """Worlds of bodies that differ in what their thrusters make of a command."""

    effect: Array  # (6 n, ...) of `effects`, one thruster after the other
    thrust: Array  # of each thruster, by that of the robot's file [-]

    @property
    def strength(self) -> Array:
        """See `Drawn.strength`."""
        return self.thrust

    @property
    def effects(self) -> Array:
        """See `SpatialWorld.effects`."""
        return self.effect.reshape((-1, 6, *self.effect.shape[1:]))

    def pushed(self, actuators: Any, applied: Array, gain: Array) -> tuple[Vector, Vector]:
        """See `SpatialWorld.pushed`."""
        thrust = clip(applied, 0.0, 1.0) * gain
        each = self.effects
        wrench = sum_of([each[i] * thrust[i] for i in range(len(thrust))])
        return (wrench[0], wrench[1], wrench[2]), (wrench[3], wrench[4], wrench[5])


@dataclass(frozen=True)
class Bodies:
    """Bodies of some episodes, one in each row."""

    mass: np.ndarray  # (worlds,) [kg]
    inertia: np.ndarray  # (worlds, 6) xx, yy, zz, xy, xz, yz [kg·m²]
    positions: np.ndarray  # (worlds, n, 3) [m]
    directions: np.ndarray  # (worlds, n, 3) unit vectors [-]
    thrust: np.ndarray  # (worlds,) of each thruster [N]

    @property
    def effect(self) -> np.ndarray:
        """Wrench of each thruster that is fully open, shape (worlds, 6, n) [N, N·m]."""
        arms = np.cross(self.positions, self.directions)
        wrenches = np.concatenate((self.directions, arms), axis=-1)
        return np.swapaxes(self.thrust[:, None, None] * wrenches, -1, -2)

    def where(self, chosen: np.ndarray, others: Bodies) -> Bodies:
        """These where chosen, shape (worlds,), else the others."""
        pairs = ((getattr(self, each.name), getattr(others, each.name)) for each in fields(self))
        return Bodies(*(np.where(chosen.reshape(-1, *[1] * (a.ndim - 1)), a, b) for a, b in pairs))


def own_bodies(robot: Robot, worlds: int) -> Bodies:
    """The robot's own body, so many times."""
    valves, body = robot.actuated_by(Thrusters), robot.body
    parts = (
        body.mass, body.tensor, [push.position for push in valves.pushes],
        [push.direction for push in valves.pushes], valves.thrust,
    )  # fmt: skip
    return Bodies(*(np.repeat(np.asarray(part, dtype=float)[None], worlds, axis=0) for part in parts))


def draw_bodies(robot: Robot, draws: Draws) -> Bodies:
    """Draw a body for each row of the draws, out of the robot's `morphology`."""
    found, own = own_bodies(robot, draws.worlds), own_bodies(robot, draws.worlds)
    spans = robot.morphology
    assert spans is not None
    done = np.zeros(draws.worlds, dtype=bool)
    for _ in range(TRIES):
        tried = _drawn(own, spans, draws)
        taken = ~done & can_be_flown(tried)
        found, done = tried.where(taken, found), done | taken
        if done.all():
            break
    return found


def _drawn(own: Bodies, spans: Morphology, draws: Draws) -> Bodies:
    count = own.positions.shape[1]
    mass = draws.uniform(*spans.mass)
    size, places, thrust = (draws.uniform(*span) for span in (spans.size, spans.places, spans.thrust))
    moments = draws.uniform(*spans.inertia, 3)
    share = mass / own.mass * size**2
    inertia = share[:, None] * own.inertia * np.concatenate((moments, np.ones_like(moments)), axis=-1)
    # Tilted by up to the angle towards any side: uniform over the cap of the sphere about each direction.
    angle = np.arccos(
        1.0 - (1.0 - math.cos(math.radians(spans.directions_deg))) * draws.uniform(0.0, 1.0, count)
    )
    towards = draws.uniform(0.0, 2.0 * math.pi, count)
    first, second = _aside(own.directions)
    tilt = np.cos(towards)[..., None] * first + np.sin(towards)[..., None] * second
    directions = np.cos(angle)[..., None] * own.directions + np.sin(angle)[..., None] * tilt
    return Bodies(mass, inertia, places[:, None, None] * own.positions, directions, thrust * own.thrust)


def _aside(directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors across each direction and one another."""
    least = np.eye(3)[np.argmin(np.abs(directions), axis=-1)]
    first = np.cross(directions, least)
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    return first, np.cross(directions, first)


def can_be_flown(bodies: Bodies) -> np.ndarray:
    """Which have force and torque every way, from thrusters that balance one another, shape (worlds,)."""
    arm = np.linalg.norm(bodies.positions, axis=-1).mean(axis=-1)
    units = np.concatenate((np.ones((len(arm), 3)), np.repeat(arm[:, None], 3, axis=1)), axis=1)
    effect = bodies.effect / units[..., None]
    sizes = np.linalg.svd(effect, compute_uv=False)
    together = effect.sum(axis=-1)[..., None]
    resting = 1.0 - (np.linalg.pinv(effect) @ together)[..., 0]
    return np.asarray((sizes[:, -1] > LEAST_RATIO * sizes[:, 0]) & (resting.min(axis=-1) > LEAST_RESTING))


def shaped(robot: Robot, world: SpatialWorld, draws: Draws) -> ShapedWorld:
    """The same worlds with bodies of the robot's `morphology`.

    Args:
        robot: The robot.
        world: What else was drawn.
        draws: That it was drawn from; another branch of theirs is used.
    """
    bodies = draw_bodies(robot, draws.branch(BRANCH))
    effect = np.swapaxes(bodies.effect, -1, -2).reshape(draws.worlds, -1).T
    plain = replace(world, mass=bodies.mass, inertia=bodies.inertia.T)
    parts: dict[str, Any] = dict(zip(plain.names(), plain.parts(), strict=True))
    return ShapedWorld(**parts, effect=effect, thrust=bodies.thrust / robot.actuated_by(Thrusters).thrust)


def robot_with(robot: Robot, bodies: Bodies, row: int) -> Robot:
    """The robot with one of these bodies, as its own file could say."""
    valves, mass, can = robot.actuated_by(Thrusters), float(bodies.mass[row]), robot.performance
    nozzles = tuple(
        replace(nozzle, position=(x, y, z), direction=(a, b, c))
        for nozzle, (x, y, z), (a, b, c) in zip(
            valves.nozzles, bodies.positions[row].tolist(), bodies.directions[row].tolist(), strict=True
        )
    )
    share = float(bodies.thrust[row]) / valves.thrust
    inertia = tuple(float(part) for part in bodies.inertia[row][: len(robot.body.inertia)])
    body = replace(robot.body, mass=mass, inertia=inertia)
    spans = replace(robot.uncertainty, mass=(mass, mass), yaw_inertia=(inertia[2], inertia[2]))
    ability = replace(can, force=share * can.force, torque=share * can.torque)
    actuators = replace(valves, nozzles=nozzles, thrust=float(bodies.thrust[row]))
    return replace(
        robot, body=body, uncertainty=spans, performance=ability, actuators=actuators, morphology=None
    )
