"""A pose that wanders through space, and what a robot that follows it observes."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.attitude import conjugate, logarithm, product
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.spatial import SpatialState, quat_of
from fulmar_core.tasks import load_task
from fulmar_core.tasks.references.named_paths import NAMED
from fulmar_core.tasks.references.planned_flight import of_one_sign

WORLDS, LONG_S = 32, 90.0


@pytest.fixture(scope="module")
def walk():
    task, robot = load_task("follow_pose_3d"), load_robot("spacecraft_16")
    draws = Draws(3, np.arange(WORLDS), np.zeros(WORLDS, dtype=int))
    start, goal = task.draw(draws, robot, training=False)
    return task, start, goal


def followed(task, goal, times):
    """The reference at some times: poses, motions and changes, each (times, worlds, n)."""
    found = [task.reference_of(task.advance(goal, None, np.asarray(time))) for time in times]
    return (np.stack([getattr(each, name) for each in found]) for name in ("pose", "motion", "change"))


def test_the_walk_keeps_to_speeds_that_robots_reach_and_to_accelerations_of_small_thrusters(walk):
    task, _, goal = walk
    _, motion, change = followed(task, goal, np.arange(0.0, LONG_S, 0.5))
    speed = np.linalg.norm(motion[..., :3], axis=-1)
    assert speed.min() > 0.01 and speed.max() < 0.21
    assert speed.max() - speed.min() > 0.1
    assert np.linalg.norm(motion[..., 3:], axis=-1).max() < 0.1
    assert np.linalg.norm(change[..., :3], axis=-1).max() < 0.05


def test_motion_and_change_of_the_walk_are_derivatives_of_its_pose(walk):
    task, _, goal = walk
    step = 1e-3
    times = np.arange(0.33, LONG_S - 1.0, 7.1)
    before, now, after = (list(followed(task, goal, times + late)) for late in (-step, 0.0, step))
    velocity = (after[0][..., :3] - before[0][..., :3]) / (2.0 * step)
    np.testing.assert_allclose(now[1][..., :3], velocity, atol=1e-6)
    np.testing.assert_allclose(
        now[2][..., :3], (after[1][..., :3] - before[1][..., :3]) / (2.0 * step), atol=1e-6
    )
    turned = product(conjugate(quat_of(before[0])), quat_of(after[0]))
    np.testing.assert_allclose(
        now[1][..., 3:], np.stack(logarithm(turned), axis=-1) / (2.0 * step), atol=1e-5
    )
    np.testing.assert_allclose(
        now[2][..., 3:], (after[1][..., 3:] - before[1][..., 3:]) / (2.0 * step), atol=1e-3
    )


def test_the_walk_looks_where_it_goes(walk):
    task, _, goal = walk
    pose, motion, _ = followed(task, goal, np.arange(1.0, LONG_S, 1.0))
    x, y, z, w = quat_of(pose)
    ahead = np.stack((1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)), axis=-1)
    way = motion[..., :3] / np.linalg.norm(motion[..., :3], axis=-1, keepdims=True)
    assert np.sum(ahead * way, axis=-1).min() > np.cos(np.radians(5.0))


def test_a_body_that_moves_with_the_target_observes_no_error(walk):
    task, _, goal = walk
    goal = task.advance(goal, None, np.asarray(41.25))
    now = task.reference_of(goal)
    state = SpatialState(*now.pose.T, *now.motion.T)
    seen = dict(zip(task.observation_names, task.observe(state, goal), strict=True))
    for name, value in seen.items():
        if "error" in name or name.startswith(("goal", "fine")):
            np.testing.assert_allclose(value, 0.0, atol=1e-7, err_msg=name)
    errors = task.errors(state, goal)
    assert errors.position.max() < 1e-9
    assert errors.attitude.max() < 1e-7
    assert np.linalg.norm([seen[f"target_acceleration_{axis}_in_body"] for axis in "xyz"]) > 0.0


def test_the_target_stands_still_at_its_last_pose(walk):
    task, _, goal = walk
    end = task.reference_of(task.advance(goal, None, np.asarray(1e4)))
    np.testing.assert_allclose(end.pose, goal.targets[:, -1], atol=1e-12)
    assert not end.motion.any() and not end.change.any()


def test_a_path_whose_quaternions_jump_to_their_negative_is_the_same_path():
    poses = np.zeros((5, 7))
    poses[:, 6] = 1.0
    flipped = poses * np.array([1.0, -1.0, -1.0, 1.0, -1.0])[:, None]
    np.testing.assert_array_equal(of_one_sign(flipped)[:, 3:], poses[:, 3:])


@pytest.mark.parametrize(
    ("wrong", "words"),
    [({"spacing_s": 0.25}, "multiple of 0.1 s"), ({"fine_angle": 0.0}, "greater than 0")],
)
def test_a_task_that_follows_no_pose_is_refused(wrong, words):
    from dataclasses import replace

    with pytest.raises(ValueError, match=words):
        replace(load_task("follow_pose_3d"), **wrong)


@pytest.mark.parametrize("law", ["pd", "lqr"])
def test_laws_stay_with_a_walk_by_what_the_reference_says_of_its_motion(law):
    from dataclasses import replace

    from fulmar_core.controllers.classical import load_classical
    from fulmar_core.loop.rollout import roll_out_in_batch
    from fulmar_core.worlds.scenario import load_scenario

    robot = load_robot("int_ball2")
    task = load_task("follow_pose_3d")
    slow = replace(task.walk, speed=(0.01, 0.03))
    task = replace(task, walk=slow, start=replace(task.start, distance=(0.0, 0.3)), episode_s=40.0)
    run = roll_out_in_batch(
        load_classical(robot, task, law=law), robot, task, load_scenario("nominal"), episodes=4, seed=5
    )
    assert run.position_error[:, -50:].max() < 0.02
    assert np.degrees(run.attitude_error[:, -50:].max()) < 2.0


@pytest.mark.parametrize("path", NAMED)
def test_in_the_place_of_the_walk_it_follows_any_path_with_x_along_it(path):
    task, robot = load_task("follow_pose_3d").along(path), load_robot("cubesat_8")
    task.check(robot)
    draws = Draws(3, np.arange(4), np.zeros(4, dtype=int))
    start, goal = task.draw(draws, robot, training=False)
    first = goal.targets[:, 0, :3]
    assert np.linalg.norm(np.stack(start.position, axis=-1) - first, axis=-1).max() < 3.01
    pose, motion, _ = followed(task, goal, np.arange(11.0, task.episode_of(robot) - 11.0, 0.7))
    x, y, z, w = quat_of(pose)
    ahead = np.stack((1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)), axis=-1)
    way = motion[..., :3] / np.linalg.norm(motion[..., :3], axis=-1, keepdims=True)
    assert np.sum(ahead * way, axis=-1).min() > np.cos(np.radians(6.0))
    speed = task.flight(robot).target.speed
    np.testing.assert_allclose(np.linalg.norm(motion[..., :3], axis=-1), speed, rtol=0.05)
