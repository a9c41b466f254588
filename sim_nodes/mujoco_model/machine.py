"""What the backend needs to know of a family of robots, and which class knows it."""

from __future__ import annotations

from typing import Protocol

import mujoco
import numpy as np

from fulmar_core.actuators.ackermann import Ackermann
from fulmar_core.actuators.differential_drive import DifferentialDrive
from fulmar_core.disturbances.world import World
from fulmar_core.planar import PlanarState
from fulmar_core.robot import Robot
from sim_nodes.mujoco_model.car import Car
from sim_nodes.mujoco_model.differential_base import DifferentialBase
from sim_nodes.mujoco_model.floater import Floater

PlanarWrench = tuple[float, float, float]  # force along the world's x and y [N], yaw moment [N·m]


class Machine(Protocol):
    """One family of robots in MuJoCo.

    Attributes:
        steps_per_tick: MuJoCo steps in one physics tick of the robot.
    """

    steps_per_tick: int

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

    def take_world(self, model: mujoco.MjModel, world: World) -> None:
        """Take mass, inertia and centre of mass of an episode, without a batch axis."""
        ...

    def place(self, model: mujoco.MjModel, data: mujoco.MjData, start: PlanarState) -> None:
        """Put the robot where an episode starts, without a batch axis."""
        ...

    def drive(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        applied: np.ndarray,
        gain: np.ndarray,
        outside: PlanarWrench,
    ) -> None:
        """Set every force of the coming tick.

        Args:
            model: The model.
            data: Its state.
            applied: What each actuator does, shape (n,).
            gain: Factor on it, shape (n,).
            outside: Push of the surroundings.
        """
        ...

    @property
    def rest_height(self) -> float:
        """Height of the body's origin at rest above z = 0 [m]."""
        ...


def machine_of(robot: Robot) -> Machine:
    """The family of a robot."""
    if isinstance(robot.actuators, DifferentialDrive):
        return DifferentialBase(robot)
    if isinstance(robot.actuators, Ackermann):
        return Car(robot)
    return Floater(robot)
