"""Paths of the plane that are lifted into space, targets that face a point, and laws that follow them closely."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.controllers.classical import load_classical
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.states.attitude import angle_between, turn
from fulmar_core.states.spatial import SpatialState, quat_of
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_at
from fulmar_core.tasks.goal_files import Trajectory
from fulmar_core.tasks.references.curves import Circle, GeronoLemniscate, Square
from fulmar_core.tasks.references.in_space import Lifted
from fulmar_core.tasks.references.rounded import Capsule, Rectangle
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.mock_backend import MockBackend
from tests.inputs import inputs_at

CUBESAT, POSE = load_robot("cubesat_8"), load_task("go_to_pose_3d")
TILTED = (30.0, 20.0, 0.0)
ROUND = Trajectory(
    "trajectory", "t", Lifted("lifted", Circle("circle", 1.8), TILTED), speed=0.2, facing="point", ease_s=6.0
)


def along(target, count=200):
    return np.array([target.pose(t) for t in np.linspace(0.0, target.duration_s, count)])


def test_a_lifted_path_lies_in_its_plane_about_its_centre():
    path = Lifted("lifted", Capsule("capsule", 3.0, 1.0), TILTED, centre=(1.0, -2.0, 3.0))
    points = path.points(400) - np.array(path.centre)
    assert np.abs(points @ path.up).max() < 1e-12
    assert np.linalg.norm(points, axis=1).max() == pytest.approx(2.5, rel=1e-3)
    assert path.closed


def test_a_rectangle_has_its_size_and_bends_by_its_corners_alone():
    path = Rectangle("rectangle", 4.0, 2.0, 0.5, centre=(1.0, 1.0))
    points = path.points(2000)
    np.testing.assert_allclose(points.min(axis=0), [-1.0, 0.0], atol=1e-3)
    np.testing.assert_allclose(points.max(axis=0), [3.0, 2.0], atol=1e-3)
    length = np.linalg.norm(np.diff(points, axis=0, append=points[:1]), axis=1).sum()
    assert length == pytest.approx(2.0 * (3.0 + 1.0) + np.pi, rel=1e-4)
    target = Trajectory("trajectory", "t", Lifted("lifted", path), speed=0.3).target()
    assert target.acceleration() == pytest.approx(0.3**2 / 0.5, rel=1e-3)


def test_sharp_corners_take_more_than_any_robot_has():
    path = Lifted("lifted", Square("square", 2.0))
    assert Trajectory("trajectory", "t", path, speed=0.2).target().acceleration() > 10.0


@pytest.mark.parametrize("curve", [Circle("circle", 1.8), Capsule("capsule", 2.0, 1.0)])
def test_x_faces_the_centre_without_a_jump_and_closes(curve):
    target = replace(ROUND, path=Lifted("lifted", curve, TILTED, centre=(1.0, 2.0, 3.0))).target()
    poses = along(target)
    x = np.stack(turn(quat_of(poses), (1.0, 0.0, 0.0)), axis=-1)
    ways = np.array([1.0, 2.0, 3.0]) - poses[:, :3]
    assert (np.sum(x * ways, axis=1) / np.linalg.norm(ways, axis=1)).min() > 1.0 - 1e-6
    assert angle_between(quat_of(poses[0]), quat_of(poses[-1])) < 1e-6
    assert np.max(angle_between(quat_of(poses[1:]), quat_of(poses[:-1]))) < 0.1


def test_a_body_that_faces_a_point_aside_does_not_roll_from_step_to_step():
    """About a figure of eight whose plane holds the line of sight, where a fixed up would flip."""
    path = Lifted("lifted", GeronoLemniscate("gerono_lemniscate", 2.0), (90.0, 0.0, 0.0))
    target = replace(ROUND, path=path, point=(0.0, 4.0, 0.5)).target()
    poses = along(target, 2000)
    assert np.rad2deg(np.max(angle_between(quat_of(poses[1:]), quat_of(poses[:-1])))) < 0.5


def test_it_begins_and_ends_at_rest_and_goes_at_its_speed_between():
    target = ROUND.target()
    assert target.duration_s == pytest.approx(2.0 * np.pi * 1.8 / 0.2 + 6.0, rel=1e-5)
    times = np.arange(0.0, target.duration_s, 0.05)
    places = np.array([target.pose(t)[:3] for t in times])
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / 0.05
    assert max(speeds[0], speeds[-1]) < 0.002
    np.testing.assert_allclose(speeds[130:-130], 0.2, rtol=1e-3)
    np.testing.assert_allclose(target.pose(1e6)[:3], places[0], atol=1e-6)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"facing": "fixed", "point": (0.0, 0.0, 1.0)}, "'point' needs facing: point"),
        ({"ease_s": 99.0}, "'ease_s' = 99 s is longer than the path, of 56.5 s"),
        (
            {"point": (1.8, 0.0, 0.0), "path": Lifted("lifted", Circle("circle", 1.8))},
            "passes through the place",
        ),
    ],
)
def test_a_target_that_cannot_be_is_refused(change, words):
    with pytest.raises(ValueError, match=words):
        replace(ROUND, **change)


@pytest.mark.parametrize(("law", "mean_m"), [("pd", 0.007), ("lqr", 0.0125)])
def test_laws_stay_with_a_target_that_bends(law, mean_m):
    """From rest, without noise, over a third of the round; without its acceleration they lag by 2 cm and more."""
    target, controller, simulator = (
        ROUND.target(),
        load_classical(CUBESAT, POSE, law=law),
        MockBackend(CUBESAT),
    )
    episode = draw_episode(CUBESAT, POSE, load_scenario("ideal"), seed=1, number=0)
    sample = simulator.reset(replace(episode, start=SpatialState.resting(target.pose(0.0))), seed=0)
    errors, angles = [], []
    for step in range(200):
        state, pose = SpatialState.from_rigid(sample.truth), target.pose(0.1 * step)
        errors.append(np.linalg.norm(np.array(state.position) - pose[:3]))
        angles.append(angle_between(state.quat, quat_of(pose)))
        goal = goal_at(tuple(pose.tolist()))
        command = controller.act(
            inputs_at(CUBESAT, POSE, state, goal, stamp_ns=1_000_000_000 + step * 100_000_000)
        )
        sample = simulator.step(command[0], 4)
    assert np.mean(errors) < mean_m
    assert np.max(errors) < 0.03
    assert np.rad2deg(np.max(angles)) < 0.5
