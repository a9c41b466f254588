"""The cameras of robots that are simulated without ROS, for evaluations and learners: states in, images out."""

from __future__ import annotations

import contextlib
from typing import Self

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.controller import Controller, Readings
from fulmar_core.dynamics.things import Poses
from fulmar_core.loop.image_input import ImageInput
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.camera import CameraConfig
from fulmar_core.states.planar import at_rest
from fulmar_core.states.state import RigidBodyState, State
from fulmar_core.tasks import Task
from sim_nodes.camera.opengl import find_platform


class CameraSight:
    """What the camera of a robot sees from many states, drawn one after the other; see `rollout.Sight`.

    A process that learns imports `torch._dynamo` first: loaded after an EGL renderer was made, its compiler ends the
    process by a segmentation fault.
    """

    def __init__(self, robot: Robot, task: Task, camera: CameraConfig | None = None) -> None:
        """Build the scene of a task.

        Args:
            robot: The robot.
            task: Has the structures, and the blocks that move.
            camera: In the place of the robot's own.

        Raises:
            ConfigError: Nothing can draw here, with what to install.
        """
        # Only here: most evaluations draw nothing.
        find_platform()  # before MuJoCo is imported, which a wrong MUJOCO_GL ends
        from sim_nodes.camera.backdrop import backdrop_of
        from sim_nodes.camera.renderer import Renderer

        own = camera or robot.sensors.camera
        assert own is not None, "a policy that sees was checked against the robot's camera"
        self._blocks = {thing.name: thing.body for thing in task.things if thing.body is not None}
        self._renderer = Renderer(own, task.structures, backdrop=backdrop_of(robot), blocks=self._blocks)

    def __call__(self, state: State, things: Poses | None = None) -> Readings:
        """Images of each state, shapes (n,): depth (n, h, w) float32 [m] and colours (n, h, w, 3) uint8.

        Args:
            state: Of the robots.
            things: Where the task's things are, each (n, 3); those left out stand where they were.
        """
        rigid = state.to_rigid()
        poses = _poses(rigid)
        blocks = {
            name: _poses(at_rest(*np.moveaxis(np.atleast_2d(pose), -1, 0)).to_rigid())
            for name, pose in (things or {}).items()
            if name in self._blocks
        }
        frames = [
            self._renderer.render(pose, {name: of[number] for name, of in blocks.items()})
            for number, pose in enumerate(poses)
        ]
        return {
            "camera_depth": np.stack([frame.depth for frame in frames]),
            "camera_image": np.stack([frame.rgb for frame in frames]),
        }

    def close(self) -> None:
        """Free what the driver holds."""
        self._renderer.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _poses(rigid: RigidBodyState) -> np.ndarray:
    """Places [m] and attitudes (x, y, z, w) of bodies, shape (n, 7)."""
    return np.atleast_2d(np.concatenate((rigid.position_in_world, rigid.quat_xyzw), axis=-1))


def sight_of(
    controller: Controller, robot: Robot, task: Task
) -> contextlib.AbstractContextManager[CameraSight | None]:
    """The camera of a robot for a controller that takes its images, to be closed; None for another one.

    Of a policy it draws only those pixels that its network takes.

    Raises:
        ConfigError: The robot has no camera, or nothing can draw here.
    """
    if not {"camera_depth", "camera_image"}.intersection(controller.readings):
        return contextlib.nullcontext()
    image: ImageInput | None = getattr(controller, "image", None)
    if robot.sensors.camera is None:
        raise ConfigError(
            f"controller '{controller.name}' takes images, and '{robot.name}' has no camera. Add 'camera' to the "
            "'sensors' of its file."
        )
    return CameraSight(robot, task, image.camera if image else None)
