"""Compiled MuJoCo model of a robot, obstacles and objects, and the interface of robot families."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from typing import Any, Protocol

import mujoco
import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.dynamics.things import Thing
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.episode import Episode
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.worlds.structures import Structure
from sim_nodes.mujoco_model.aircraft import Aircraft
from sim_nodes.mujoco_model.car import Car
from sim_nodes.mujoco_model.differential_base import DifferentialBase
from sim_nodes.mujoco_model.floater import Floater
from sim_nodes.mujoco_model.free_flyer import FreeFlyer
from sim_nodes.mujoco_model.objects import (
    add_block,
    add_obstacles,
    has_room,
    place_block,
    place_obstacles,
)
from sim_nodes.mujoco_model.satellite import Satellite
from sim_nodes.mujoco_model.scenery import BODY, add_scenery, add_sensors
from sim_nodes.mujoco_model.structures import add_structure


def _rolling(robot: Robot) -> RobotModel:
    """Families on wheels each have a chassis of their own."""
    kind = robot.actuators.kind
    if kind not in WHEELED:
        raise ConfigError(
            f"there is no MuJoCo model of robots with {kind} such as '{robot.name}'; there is one for what pushes, "
            f"and for {', '.join(WHEELED)}. Use --backend mock."
        )
    return WHEELED[kind](robot)


WHEELED: dict[str, Callable[[Robot], RobotModel]] = {"differential_drive": DifferentialBase, "ackermann": Car}
BY_KIND: dict[str, Callable[[Robot], RobotModel]] = defaultdict(
    lambda: FreeFlyer, planar=Floater, rolling=_rolling, satellite=Satellite, aircraft=Aircraft
)
PALE, WATER = [0.85, 0.87, 0.9, 1.0], [0.55, 0.75, 0.85, 1.0]


class Scene:
    """A robot's model with room for some obstacles and things."""

    def __init__(
        self,
        robot: Robot,
        radii: tuple[float, ...] = (),
        things: tuple[Thing, ...] = (),
        structures: tuple[Structure, ...] = (),
    ) -> None:
        """Compile.

        Args:
            robot: The robot.
            radii: Of the obstacles that there is room for [m].
            things: Those with a body have one in the model; the others do not move.
            structures: Things in space, which stand still and which the robot runs into.

        Raises:
            ConfigError: MuJoCo rejects the robot.
        """
        self._radii, self._things = radii, things
        self._poses: dict[str, np.ndarray] = {}
        self.robot_model: RobotModel = robot_model_of(robot)
        try:
            self.model = _spec(robot, self.robot_model, radii, things, structures).compile()
        except ValueError as error:
            raise ConfigError(
                f"robot '{robot.name}': MuJoCo cannot build it: {' '.join(str(error).split())}. "
                "Mass and inertia of the body less those of its wheels have to be those of a body that can exist."
            ) from error
        self.robot_model.bind(self.model)
        self.data = mujoco.MjData(self.model)
        self._scratch = mujoco.MjData(self.model)
        self._body = self.model.body(BODY).id
        self._whole = 0.0, np.zeros(3)  # mass and moments of inertia when the episode began

    def has_room_for(self, obstacles: np.ndarray) -> bool:
        """Whether these obstacles can be shown, shape (m, 3); if not, another scene has to be compiled."""
        return has_room(self._radii, obstacles)

    def begin(self, episode: Episode) -> None:
        """Set the start of an episode: bodies, robot, obstacles and things."""
        self.robot_model.take_world(self.model, episode.world)
        self._whole = float(self.model.body_mass[self._body]), self.model.body_inertia[self._body].copy()
        mujoco.mj_setConst(self.model, self.data)
        mujoco.mj_resetData(self.model, self.data)
        self.robot_model.place(self.model, self.data, episode.start)
        place_obstacles(self.model, self.data, np.asarray(episode.goal.obstacles))
        for thing in self._things:
            pose = np.array(episode.goal.things[thing.name], dtype=float)
            self._poses[thing.name] = pose
            if thing.body is not None:
                place_block(self.model, self.data, thing.name, float(pose[0]), float(pose[1]))

    def place(self, state: Any) -> None:
        """Put the robot into a state of its form, without a batch axis; things stay where they are."""
        poses = self.things
        self.robot_model.place(self.model, self.data, state)
        for thing in self._things:
            if thing.body is not None:
                x, y, _ = poses[thing.name]
                place_block(self.model, self.data, thing.name, float(x), float(y))

    def lighten(self, share: float) -> None:
        """Leave the robot's body a share of the mass and inertia with which the episode began."""
        mass, moments = self._whole
        self.model.body_mass[self._body], self.model.body_inertia[self._body] = share * mass, share * moments
        mujoco.mj_setConst(self.model, self._scratch)

    @property
    def things(self) -> dict[str, np.ndarray]:
        """Poses of the things, each (3,) [m, m, rad]; pushed things are round and keep their heading."""
        return {thing.name: self._pose_of(thing) for thing in self._things}

    def _pose_of(self, thing: Thing) -> np.ndarray:
        pose = self._poses[thing.name]
        if thing.body is None:
            return pose
        x, y, _ = self.data.body(thing.name).xpos
        return np.array([x, y, pose[2]])


def build_model(robot: Robot) -> mujoco.MjModel:
    """The compiled model of a robot alone."""
    return Scene(robot).model


def _spec(
    robot: Robot,
    robot_model: RobotModel,
    radii: tuple[float, ...],
    things: tuple[Thing, ...],
    structures: tuple[Structure, ...],
) -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    spec.modelname = robot.name
    spec.option.timestep = robot.timing.physics_dt / robot_model.steps_per_tick
    spec.option.gravity = [0.0, 0.0, -GRAVITY if robot.kind.weighs else 0.0]
    in_space = robot_model.in_space
    # Euler's method as in the core's plane; a free body tumbles, and would gain energy by it.
    kinds = mujoco.mjtIntegrator
    spec.option.integrator = kinds.mjINT_RK4 if in_space else kinds.mjINT_EULER
    # A diverged state has to stay, so that the backend sees it; MuJoCo would silently reset it.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    floor = PALE if robot.hydrodynamics is None else WATER
    add_scenery(spec, None if in_space else floor)
    add_sensors(spec, robot_model.add(spec))
    add_obstacles(spec, radii)
    for thing in things:
        if thing.body is not None:
            add_block(spec, thing.name, thing.body)
    for structure in structures:
        add_structure(spec, structure)
    return spec


class RobotModel(Protocol):
    """One family of robots in MuJoCo.

    Attributes:
        steps_per_tick: MuJoCo steps in one physics tick of the robot.
        in_space: Whether it moves freely, without floor or water.
    """

    steps_per_tick: int
    in_space: bool

    @property
    def steady(self) -> bool:
        """Whether the forces of one tick hold for the next one where the actuators do the same."""
        ...

    def add(self, spec: mujoco.MjSpec) -> mujoco.MjsBody:
        """Add bodies, joints and actuators to a model; returns the body that carries the sensors."""
        ...

    def bind(self, model: mujoco.MjModel) -> None:
        """Look up in a compiled model what the other methods need."""
        ...

    def take_world(self, model: mujoco.MjModel, world: Any) -> None:
        """Take mass, inertia and centre of mass of an episode, without a batch axis."""
        ...

    def place(self, model: mujoco.MjModel, data: mujoco.MjData, start: Any) -> None:
        """Put the robot where an episode starts, without a batch axis."""
        ...

    def drive(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        applied: np.ndarray,
        gain: np.ndarray,
        outside: Any,
    ) -> None:
        """Set every force of the coming tick.

        Args:
            model: The model.
            data: Its state.
            applied: What each actuator does, shape (n,).
            gain: Factor on it, shape (n,).
            outside: Push of the surroundings, as in `batch_dynamics.Dynamics.outside`, of one world.
        """
        ...

    def own_truth(self, data: mujoco.MjData) -> dict[str, Any]:
        """What is true of robots of this family alone, see `Truth.more`."""
        ...

    @property
    def rest_height(self) -> float:
        """Height of the body's origin at rest above z = 0 [m]."""
        ...


def robot_model_of(robot: Robot) -> RobotModel:
    """The MuJoCo model of a robot's family.

    Raises:
        ConfigError: The family has none.
    """
    return BY_KIND[robot.kind.name](robot)
