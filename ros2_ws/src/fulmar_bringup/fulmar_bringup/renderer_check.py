"""Whether what a plan draws can be drawn here, before any process is started."""

from __future__ import annotations

import importlib.util

from fulmar_bringup.camera_row import CAMERA
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from sim_nodes.camera.opengl import check_loadable, find_platform


def check_renderer(plan: RunPlan, robot: Robot) -> None:
    """Refuse a camera that is not there or that nothing can draw, and a MUJOCO_GL that ends a simulator.

    Raises:
        ConfigError: One of these.
    """
    if importlib.util.find_spec("mujoco") is None:  # named with what else is not installed
        return
    if CAMERA in plan.extras:
        _check_camera(plan, robot)
        find_platform()
    elif plan.backend == "mujoco" or plan.emulated:
        check_loadable()


def _check_camera(plan: RunPlan, robot: Robot) -> None:
    if plan.backend == "hardware":
        raise ConfigError(
            "--camera draws what a simulated robot would see; a real robot has a camera of its own. Leave it out."
        )
    if robot.sensors.camera is None:
        others = [name for name in config_names("robots") if load_robot(name).sensors.camera is not None]
        raise ConfigError(
            f"'{robot.name}' has no camera. Add 'camera' to 'sensors' in its file, or use a robot that has one: "
            f"{', '.join(others) or 'none is shipped'}."
        )
