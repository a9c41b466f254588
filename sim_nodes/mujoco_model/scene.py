"""One compiled model: a robot and what stands about it."""

from __future__ import annotations

import mujoco
import numpy as np

from fulmar_core.dynamics.pushing import Block
from fulmar_core.episode import Episode
from fulmar_core.errors import ConfigError
from fulmar_core.goal import Goal
from fulmar_core.robot import Robot
from sim_nodes.mujoco_model.block import NAME as BLOCK
from sim_nodes.mujoco_model.block import add_block, place_block
from sim_nodes.mujoco_model.machine import Machine, machine_of
from sim_nodes.mujoco_model.obstacles import add_obstacles, place_obstacles, there_is_room
from sim_nodes.mujoco_model.surroundings import add_sensors, add_surroundings

PALE, WATER = [0.85, 0.87, 0.9, 1.0], [0.55, 0.75, 0.85, 1.0]


class Scene:
    """A robot's model with room for some obstacles, and perhaps a block."""

    def __init__(self, robot: Robot, radii: tuple[float, ...] = (), block: Block | None = None) -> None:
        """Compile.

        Args:
            robot: The robot.
            radii: Of the obstacles that there is room for [m].
            block: The thing to push; None for none.

        Raises:
            ConfigError: MuJoCo finds that there can be no such robot.
        """
        self._radii, self._block = radii, block
        self.machine: Machine = machine_of(robot)
        try:
            self.model = _spec(robot, self.machine, radii, block).compile()
        except ValueError as error:
            raise ConfigError(
                f"robot '{robot.name}': MuJoCo cannot build it: {' '.join(str(error).split())}. "
                "Mass and inertia of the body less those of its wheels have to be those of a body that can exist."
            ) from error
        self.machine.bind(self.model)
        self.data = mujoco.MjData(self.model)

    def has_room_for(self, obstacles: np.ndarray) -> bool:
        """Whether these obstacles can be shown, shape (m, 3); if not, another scene has to be compiled."""
        return there_is_room(self._radii, obstacles)

    def begin(self, episode: Episode) -> None:
        """Put everything as an episode begins: bodies, the robot at its start, obstacles and block."""
        self.machine.take_world(self.model, episode.world)
        mujoco.mj_setConst(self.model, self.data)
        mujoco.mj_resetData(self.model, self.data)
        self.machine.place(self.model, self.data, episode.start)
        self._place_things(episode.goal)

    def _place_things(self, goal: Goal) -> None:
        place_obstacles(self.model, self.data, np.asarray(goal.obstacles))
        if self._block is not None:
            place_block(self.model, self.data, float(goal.block[0]), float(goal.block[1]))

    @property
    def block_place(self) -> np.ndarray | None:
        """Where the block is, shape (2,); None where there is none [m]."""
        return None if self._block is None else np.array(self.data.body(BLOCK).xpos[:2])


def build_model(robot: Robot) -> mujoco.MjModel:
    """Compile a robot alone.

    Args:
        robot: The robot.

    Returns:
        The compiled model.
    """
    return Scene(robot).model


def _spec(robot: Robot, machine: Machine, radii: tuple[float, ...], block: Block | None) -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    spec.modelname = robot.name
    spec.option.timestep = robot.timing.physics_dt / machine.steps_per_tick
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    # A state that blew up has to stay so that the backend sees it; MuJoCo would quietly begin anew at the origin.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    add_surroundings(spec, PALE if robot.hydrodynamics is None else WATER)
    add_sensors(spec, machine.add(spec))
    add_obstacles(spec, radii)
    if block is not None:
        add_block(spec, block)
    return spec
