"""The mirror image of what a robot sees and does, left for right or front for back."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.simulation.symmetry import Mirror
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import Goal
from fulmar_core.tasks.observation import Observer
from fulmar_core.worlds.scenario import load_scenario

PAIRS = [
    ("kingfisher", "go_through_positions", "sides"),
    ("kingfisher", "go_to_position", "sides"),
    ("turtlebot2", "go_to_pose", "sides"),
    ("leatherback", "go_through_positions", "sides"),
    ("turtlebot2", "go_through_positions", "ends"),
    ("jetbot", "go_to_position", "ends"),
]
WORLDS = 32
# What becomes of x, y and yaw, and of their rates, in the mirror image.
IMAGE = {"sides": np.array([1.0, -1.0, -1.0]), "ends": np.array([-1.0, -1.0, 1.0])}


@pytest.mark.parametrize(("robot", "task", "alike"), PAIRS)
def test_a_mirrored_situation_is_seen_as_the_mirror_says(robot, task, alike):
    the_robot, the_task = load_robot(robot), load_task(task)
    rng = np.random.default_rng(5)
    pose, velocity = rng.uniform(-1.0, 1.0, (2, 3, WORLDS))
    targets = rng.uniform(-2.0, 2.0, (WORLDS, 3, 3))
    scale = np.asarray(the_robot.actuators.scale)
    shares = rng.uniform(-1.0, 1.0, (WORLDS, len(scale)))
    observer, mirror = Observer(the_robot, the_task), Mirror.of(the_robot, the_task, alike)

    def goal(points):
        return Goal(points, np.zeros(WORLDS, dtype=int), np.zeros((WORLDS, 0, 3)))

    sign = IMAGE[alike]
    seen = observer(PlanarState(*pose, *velocity), goal(targets), shares * scale)
    image = observer(
        PlanarState(*(sign[:, None] * pose), *(sign[:, None] * velocity)),
        goal(targets * sign),
        shares @ mirror.done * scale,
    )
    np.testing.assert_allclose(seen @ mirror.seen, image, atol=1e-6)


@pytest.mark.parametrize(
    ("robot", "alike"),
    [
        *((robot, "sides") for robot in ("kingfisher", "turtlebot2", "leatherback")),
        ("turtlebot2", "ends"),
        ("jetbot", "ends"),
    ],
)
def test_mirrored_commands_drive_the_mirrored_way(robot, alike):
    the_robot, task = load_robot(robot), load_task("go_to_position")
    mirror = Mirror.of(the_robot, task, alike)
    simulation = BatchSimulation(the_robot, task, load_scenario("nominal"), worlds=2, seed=1, training=False)
    state = simulation.truth
    for name in ("x", "y", "yaw", "vx", "vy", "yaw_rate"):
        getattr(state, name)[:] = 0.0
    share = np.array([[0.9, 0.4], [0.0, 0.0]])
    share[1] = share[0] @ mirror.done
    for _ in range(20):
        simulation.step(share * np.asarray(the_robot.actuators.scale))
    pose, image = np.stack([getattr(simulation.truth, name) for name in ("x", "y", "yaw")], axis=1)
    assert np.hypot(pose[0], pose[1]) > 0.02
    assert abs(pose[2]) > 0.05
    np.testing.assert_allclose(image * IMAGE[alike], pose, atol=1e-6)


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
