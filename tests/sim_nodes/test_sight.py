"""What a camera without ROS sees: the same things as the one of a run."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.camera import CameraConfig
from fulmar_core.states.planar import at_rest
from fulmar_core.tasks import load_task
from sim_nodes.sight import CameraSight
from tests.drawing import drawn_by

CAMERA = CameraConfig()
(BLOCK,) = [thing for thing in load_task("push_block").things if thing.body is not None]


def depth_seen(where: np.ndarray) -> np.ndarray:
    """Depth in the middle of the image of robots at the origin, one for each pose of the block."""
    zero = np.zeros(len(where))
    with CameraSight(load_robot("floating_platform"), load_task("push_block"), CAMERA) as sight:
        seen = sight(at_rest(zero, zero, zero), {BLOCK.name: where, "goal": where})
    return seen["camera_depth"][:, CAMERA.height // 2 - 1, CAMERA.width // 2]


def test_each_robot_sees_the_block_of_its_own_world():
    where = np.array([[1.5, 0.0, 0.0], [2.5, 0.0, 1.0], [-2.0, 0.0, 0.0]])
    ahead = drawn_by(depth_seen, where)
    assert ahead[:2] == pytest.approx(where[:2, 0] - BLOCK.body.radius, rel=1e-3)
    assert ahead[2] > 3.0
