"""What controller nodes in the process of a test load, whatever their parameter `controller` says."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.law import Law
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.loop.policy_bundle import NETWORK, read_golden, read_passport, write_bundle
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task
from policy_server.controllers import shipped_policy


def make_lqr(robot: Robot, task: Task, settings: ControllerSettings) -> Law:
    """The LQR with the robot's weights."""
    return load_classical(robot, task, control_hz=settings.control_rate(robot), law="lqr")


def make_classical(robot: Robot, task: Task, settings: ControllerSettings) -> Law:
    """The law of the robot's family with its gains."""
    return load_classical(robot, task, control_hz=settings.control_rate(robot))


def copy_of(folder: Path, name: str) -> Path:
    """The shipped bundle with another note, so that its hash differs and its commands do not."""
    bundle = shutil.copytree(shipped_policy("floating_platform", "go_to_pose"), folder / name)
    passport = read_passport(bundle)
    noted = replace(passport, training={**passport.training, "note": name})
    write_bundle(bundle, (bundle / NETWORK).read_bytes(), read_golden(bundle), noted)
    return bundle
