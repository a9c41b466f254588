"""One compiled model: a robot and what stands about it."""

from __future__ import annotations

import mujoco
import numpy as np

from fulmar_core.robot import Robot
from sim_nodes.mujoco_model.machine import Machine, machine_of
from sim_nodes.mujoco_model.obstacles import add_obstacles, place_obstacles, there_is_room
from sim_nodes.mujoco_model.surroundings import add_sensors, add_surroundings

PALE, WATER = [0.85, 0.87, 0.9, 1.0], [0.55, 0.75, 0.85, 1.0]


class Scene:
    """A robot's model with room for some obstacles."""

    def __init__(self, robot: Robot, radii: tuple[float, ...] = ()) -> None:
        """Compile.

        Args:
            robot: The robot.
            radii: Of the obstacles that there is room for [m].
        """
        self.robot, self.radii = robot, radii
        self.machine: Machine = machine_of(robot)
        self.model = _spec(robot, self.machine, radii).compile()
        self.machine.bind(self.model)
        self.data = mujoco.MjData(self.model)

    def has_room_for(self, obstacles: np.ndarray) -> bool:
        """Whether these obstacles can be shown, shape (m, 3); if not, another scene has to be compiled."""
        return there_is_room(self.radii, obstacles)

    def place_obstacles(self, obstacles: np.ndarray) -> None:
        """Move the obstacles of a new episode into place, shape (m, 3)."""
        place_obstacles(self.model, self.data, obstacles)


def build_model(robot: Robot) -> mujoco.MjModel:
    """Compile a robot alone.

    Args:
        robot: The robot.

    Returns:
        The compiled model.
    """
    return Scene(robot).model


def _spec(robot: Robot, machine: Machine, radii: tuple[float, ...]) -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    spec.modelname = robot.name
    spec.option.timestep = robot.timing.physics_dt / machine.steps_per_tick
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    # A state that blew up has to stay so that the backend sees it; MuJoCo would quietly begin anew at the origin.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    add_surroundings(spec, PALE if robot.hydrodynamics is None else WATER)
    add_sensors(spec, machine.add(spec))
    add_obstacles(spec, radii)
    return spec
