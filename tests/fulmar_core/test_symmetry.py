"""The mirror image of what a robot sees and does, left for right or front for back."""

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
    ("kingfisher", "go_through_positions", "sides"),
    ("kingfisher", "go_to_position", "sides"),
    ("turtlebot2", "go_to_pose", "sides"),
    ("leatherback", "go_through_positions", "sides"),
    ("turtlebot2", "go_through_positions", "ends"),
    ("jetbot", "go_to_position", "ends"),
]
WORLDS = 32
LEFT_FOR_RIGHT = np.array([1.0, -1.0, -1.0])
FRONT_FOR_BACK = np.array([-1.0, -1.0, 1.0])


@pytest.mark.parametrize(("robot", "task", "alike"), PAIRS)
def test_a_mirrored_situation_is_seen_as_the_mirror_says(robot, task, alike):
    the_robot, the_task = load_robot(robot), load_task(task)
    rng = np.random.default_rng(5)
    x, y, yaw, vx, vy, r = rng.uniform(-1.0, 1.0, (6, WORLDS))
    targets = rng.uniform(-2.0, 2.0, (WORLDS, 3, 3))
    scale = np.asarray(the_robot.actuators.scale)
    shares = rng.uniform(-1.0, 1.0, (WORLDS, len(scale)))
    observer, mirror = Observer(the_robot, the_task), Mirror.of(the_robot, the_task, alike)

    def goal(points):
        return Goal(points, np.zeros(WORLDS, dtype=int), np.zeros((WORLDS, 0, 3)), np.zeros((WORLDS, 2)))

    seen = observer(PlanarState(x, y, yaw, vx, vy, r), goal(targets), shares * scale)
    image = observer(
        PlanarState(x, -y, -yaw, vx, -vy, -r) if alike == "sides" else PlanarState(-x, -y, yaw, -vx, -vy, r),
        goal(targets * (LEFT_FOR_RIGHT if alike == "sides" else FRONT_FOR_BACK)),
        shares @ mirror.done * scale,
    )
    np.testing.assert_allclose(seen @ mirror.seen, image, atol=1e-6)


def driven(robot, mirror, share):
    """Where a command, and its mirror image, drive a robot from rest: x, y and yaw, shapes (2,)."""
    simulation = BatchSimulation(
        robot,
        load_task("go_to_position"),
        load_scenario("nominal"),
        worlds=2,
        seed=1,
        training=False,
        strength=1.0,
    )
    for name in ("x", "y", "yaw", "vx", "vy", "yaw_rate"):
        getattr(simulation.truth, name)[:] = 0.0
    shares = np.stack((share, share @ mirror.done))
    for _ in range(20):
        simulation.step(shares * np.asarray(robot.actuators.scale))
    return [np.asarray(getattr(simulation.truth, name)) for name in ("x", "y", "yaw")]


@pytest.mark.parametrize("robot", ["kingfisher", "turtlebot2", "leatherback"])
def test_mirrored_commands_drive_the_mirrored_way(robot):
    the_robot = load_robot(robot)
    mirror = Mirror.of(the_robot, load_task("go_to_position"), "sides")
    x, y, yaw = driven(the_robot, mirror, np.array([0.9, 0.4]))
    assert abs(yaw[0]) > 0.05
    np.testing.assert_allclose((x[1], -y[1], -yaw[1]), (x[0], y[0], yaw[0]), atol=1e-6)


@pytest.mark.parametrize("robot", ["turtlebot2", "jetbot"])
def test_turned_commands_drive_astern_as_their_image_drives_ahead(robot):
    the_robot = load_robot(robot)
    mirror = Mirror.of(the_robot, load_task("go_to_position"), "ends")
    x, y, yaw = driven(the_robot, mirror, np.array([0.9, 0.4]))
    assert np.hypot(x[0], y[0]) > 0.02
    assert abs(yaw[0]) > 0.05
    np.testing.assert_allclose((-x[1], -y[1], yaw[1]), (x[0], y[0], yaw[0]), atol=1e-6)


def test_a_robot_whose_sides_differ_is_refused():
    with pytest.raises(ConfigError, match=r"two sides of 'floating_platform'.*Leave 'mirror' out"):
        Mirror.of(load_robot("floating_platform"), load_task("go_to_position"), "sides")


@pytest.mark.parametrize("robot", ["kingfisher", "leatherback", "floating_platform"])
def test_a_robot_whose_ends_differ_is_refused(robot):
    with pytest.raises(ConfigError, match=f"'{robot}' does not drive astern as it drives ahead"):
        Mirror.of(load_robot(robot), load_task("go_to_position"), "ends")


@pytest.mark.parametrize("task", ["go_to_pose", "race_gates"])
def test_a_task_where_the_end_that_is_ahead_counts_is_refused(task):
    with pytest.raises(ConfigError, match=r"it counts which end is ahead.*Set 'mirror: sides'"):
        Mirror.of(load_robot("turtlebot2"), load_task(task), "ends")


@pytest.mark.parametrize("alike", ["sides", "ends"])
def test_a_task_without_a_goal_on_a_side_is_refused(alike):
    with pytest.raises(ConfigError, match="no goal that lies on a side"):
        Mirror.of(load_robot("turtlebot2"), load_task("track_velocities"), alike)
