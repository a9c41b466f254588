"""The mirror image of what a robot sees and does."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.errors import ConfigError
from fulmar_core.goal import Goal
from fulmar_core.observation import Observer
from fulmar_core.planar import PlanarState
from fulmar_core.robot import load_robot
from fulmar_core.simulation import BatchSimulation
from fulmar_core.symmetry import Mirror
from fulmar_core.tasks import load_task

PAIRS = [
    ("kingfisher", "go_through_positions"),
    ("kingfisher", "go_to_position"),
    ("turtlebot2", "go_to_pose"),
    ("leatherback", "go_through_positions"),
]
WORLDS = 32
LEFT_FOR_RIGHT = np.array([1.0, -1.0, -1.0])


@pytest.mark.parametrize(("robot", "task"), PAIRS)
def test_a_mirrored_situation_is_seen_as_the_mirror_says(robot, task):
    the_robot, the_task = load_robot(robot), load_task(task)
    rng = np.random.default_rng(5)
    x, y, yaw, vx, vy, r = rng.uniform(-1.0, 1.0, (6, WORLDS))
    targets = rng.uniform(-2.0, 2.0, (WORLDS, 3, 3))
    scale = np.asarray(the_robot.actuators.scale)
    shares = rng.uniform(-1.0, 1.0, (WORLDS, len(scale)))
    observer, mirror = Observer(the_robot, the_task), Mirror.of(the_robot, the_task)

    def goal(points):
        return Goal(points, np.zeros(WORLDS, dtype=int), np.zeros((WORLDS, 0, 3)), np.zeros((WORLDS, 2)))

    seen = observer(PlanarState(x, y, yaw, vx, vy, r), goal(targets), shares * scale)
    image = observer(
        PlanarState(x, -y, -yaw, vx, -vy, -r), goal(targets * LEFT_FOR_RIGHT), shares @ mirror.done * scale
    )
    np.testing.assert_allclose(seen @ mirror.seen, image, atol=1e-6)


@pytest.mark.parametrize("robot", ["kingfisher", "turtlebot2", "leatherback"])
def test_mirrored_commands_drive_the_mirrored_way(robot):
    the_robot, task = load_robot(robot), load_task("go_to_position")
    mirror = Mirror.of(the_robot, task)
    simulation = BatchSimulation(
        the_robot, task, load_scenario("nominal"), worlds=2, seed=1, training=False, strength=1.0
    )
    state = simulation.truth
    for name in ("x", "y", "yaw", "vx", "vy", "yaw_rate"):
        getattr(state, name)[:] = 0.0
    share = np.array([[0.9, 0.4], [0.0, 0.0]])
    share[1] = share[0] @ mirror.done
    for _ in range(20):
        simulation.step(share * np.asarray(the_robot.actuators.scale))
    x, y, yaw = (np.asarray(getattr(simulation.truth, name)) for name in ("x", "y", "yaw"))
    assert abs(yaw[0]) > 0.05
    np.testing.assert_allclose((x[1], -y[1], -yaw[1]), (x[0], y[0], yaw[0]), atol=1e-6)


def test_a_robot_whose_sides_differ_is_refused():
    with pytest.raises(ConfigError, match=r"two sides of 'floating_platform'.*Leave 'mirror' out"):
        Mirror.of(load_robot("floating_platform"), load_task("go_to_position"))


def test_a_task_without_a_goal_on_a_side_is_refused():
    with pytest.raises(ConfigError, match="no goal that lies on a side"):
        Mirror.of(load_robot("turtlebot2"), load_task("track_velocities"))
