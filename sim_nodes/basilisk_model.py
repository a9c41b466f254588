"""Robots in Basilisk: what each is built of, and what drives it in every tick.

Basilisk integrates the body with its thrusters or reaction wheels; the core supplies valves, supply, motors,
disturbances and sensors. Basilisk's body has its origin in the centre of mass, so that a push of the surroundings turns
nothing.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from fulmar_core.dynamics.motion import left_of
from fulmar_core.dynamics.rigid_body import matrix_of
from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.robot import Robot
from fulmar_core.states.attitude import Quaternion, Vector, turn_back
from fulmar_core.states.spatial import SpatialState
from fulmar_core.worlds.spatial_world import SpatialWorld
from sim_nodes.basilisk_process import BasiliskCraft
from sim_nodes.one_world import OneWorld

LONGEST_STEP_S = 0.02  # of Basilisk's fourth-order integration; 1 rad/s errs by 1e-7 rad in a minute [s]
Answer = dict[str, Any]


class BasiliskModel(ABC):
    """One robot in Basilisk."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.steps = math.ceil(robot.timing.physics_dt / LONGEST_STEP_S - 1e-9)  # in a tick

    def center(self, world: SpatialWorld) -> Vector:
        """Centre of mass in the body's frame, shapes of the world's arrays [m]."""
        x, y, z = np.asarray(world.com)
        return x, y, z

    @abstractmethod
    def parts(self, world: SpatialWorld) -> dict[str, Any]:
        """Thrusters and wheels, as in `basilisk_server.Craft`; `world` without a batch axis."""

    @abstractmethod
    def drive(self, craft: BasiliskCraft, one: OneWorld, ticks: int, before: Answer) -> Answer:
        """Move under a command that has begun.

        Args:
            craft: The body.
            one: Its actuators and surroundings.
            ticks: Physics steps, >= 1.
            before: The state where it begins, as in `basilisk_server`.

        Returns:
            The state after them.
        """

    def description(self, world: SpatialWorld, center: SpatialState) -> dict[str, Any]:
        """The request that builds the body.

        Args:
            world: Of the episode, without a batch axis.
            center: State of the centre of mass, shapes (1,).
        """
        state = center[0].to_rigid()
        return {
            "step_ns": round(1e9 * self.robot.timing.physics_dt / self.steps),
            "mass": float(world.mass),
            "inertia": matrix_of(world.inertia).tolist(),
            "position": state.position_in_world.tolist(),
            "velocity": state.velocity_in_world.tolist(),
            "mrp": Rotation.from_quat(state.quat_xyzw).as_mrp().tolist(),
            "rate": state.angular_velocity_in_body.tolist(),
            **self.parts(world),
        }


class FreeFlyer(BasiliskModel):
    """A body that thrusters or fans push."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._actuators = robot.actuated_by(Pushing)

    def parts(self, world: SpatialWorld) -> dict[str, Any]:
        """Thrusters that make the wrench of each actuator; see `BasiliskModel.parts`."""
        each = self._actuators.wrench_per_newton
        if world.effects is not None:
            each = np.asarray(world.effects) / self._actuators.full_thrust[:, None]
        self._strength = np.linalg.norm(each[:, :3], axis=1)
        directions = each[:, :3] / self._strength[:, None]
        moments = each[:, 3:] / self._strength[:, None]
        arms = np.cross(directions, moments) - np.asarray(world.com)
        couples = (directions * moments).sum(axis=1)
        return {
            "thrusters": [
                {"place": arm.tolist(), "direction": direction.tolist(), "couple": float(couple)}
                for arm, direction, couple in zip(arms, directions, couples, strict=True)
            ],
            "wheels": [],
        }

    def drive(self, craft: BasiliskCraft, one: OneWorld, ticks: int, before: Answer) -> Answer:
        """See `BasiliskModel.drive`; ticks in which nothing changes are one move."""
        actuation = one.actuation
        world: Any = one.world  # of a robot in space
        outside = [float(part[0]) for part in one.outside]
        steady = np.asarray(world.torque)[:, 0] + (outside[3:] or np.zeros(3))
        lost, moves = actuation.lost, list[dict[str, Any]]()
        for _ in range(ticks):
            applied = actuation.advance(self.robot.timing.physics_dt, latest_s=one.latest_s)
            thrusts = self._strength * self._actuators.thrusts(applied[:, 0]) * actuation.gain[:, 0]
            move = {"drive": thrusts.tolist(), "force": outside[:3], "torque": steady.tolist()}
            if lost is not None:
                share, lost = left_of(world.mass, lost, actuation.lost)
                kept = float(share[0])
                inertia = kept * matrix_of(world.inertia[:, 0])
                move |= {"mass": kept * float(world.mass[0]), "inertia": inertia.tolist()}
            add_move(moves, move, self.steps)
        return craft.ask(moves=moves)


class Satellite(BasiliskModel):
    """A body that reaction wheels turn."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._wheels = robot.actuated_by(ReactionWheels)
        unloading = self._wheels.unloading
        self._magnetic = unloading is not None and unloading.kind == "magnetic"

    def center(self, world: SpatialWorld) -> Vector:
        """Its origin, as in the core."""
        x, y, z = 0.0 * np.asarray(world.com)
        return x, y, z

    def parts(self, world: SpatialWorld) -> dict[str, Any]:
        """Its wheels; see `BasiliskModel.parts`."""
        self._growth = 1.0
        return {
            "thrusters": [],
            "wheels": self._wheels.axes.tolist(),
            "spin_inertia": self._wheels.spin_inertia,
        }

    def drive(self, craft: BasiliskCraft, one: OneWorld, ticks: int, before: Answer) -> Answer:
        """See `BasiliskModel.drive`; torques depend on speeds and attitude, and are computed in each tick."""
        wheels, dt, state = self._wheels, self.robot.timing.physics_dt, before
        actuation: Any = one.actuation  # of wheels, as in `actuation_of`
        outside = [float(part[0]) for part in one.outside]
        force, steady, growth = outside[:3], np.array(outside[3:6]), outside[9]
        field: Vector = (outside[6], outside[7], outside[8])
        world: Any = one.world  # of a robot in space
        for _ in range(ticks):
            doing = (actuation.advance(dt, latest_s=one.latest_s) * actuation.gain)[:, 0]
            speeds = actuation.speeds[:, 0]
            motors = wheels.motor_torque(doing[: wheels.count], speeds, dt) + wheels.friction_torque(speeds)
            here = turn_back(quat_of(state), field) if self._magnetic else None
            unloading = wheels.unloading_torque(doing, here)
            torque = steady if unloading is None else steady + np.array(unloading)
            move = {"drive": motors.tolist(), "force": force, "torque": torque.tolist()}
            if growth != self._growth:
                inertia = growth * matrix_of(world.inertia[:, 0])
                move |= {"mass": float(world.mass[0]), "inertia": inertia.tolist()}
                self._growth = growth
            state = craft.ask(moves=[{**move, "steps": self.steps}])
            actuation.speeds = np.array(state["speeds"])[:, None]
        return state


def add_move(moves: list[dict[str, Any]], move: dict[str, Any], steps: int) -> None:
    """Add integration steps to the last move where nothing has changed since, or a new move."""
    if moves and {**moves[-1], "steps": steps} == {**move, "steps": steps}:
        moves[-1]["steps"] += steps
    else:
        moves.append({**move, "steps": steps})


def quat_of(state: Answer) -> Quaternion:
    """Attitude of an answer as a unit quaternion."""
    x, y, z, w = Rotation.from_mrp(state["mrp"]).as_quat()
    return x, y, z, w


MODELS: dict[str, type[BasiliskModel]] = {"free_flyer": FreeFlyer, "satellite": Satellite}


def model_of(robot: Robot) -> BasiliskModel:
    """The model of a robot that floats in space."""
    return MODELS[robot.kind.name](robot)
