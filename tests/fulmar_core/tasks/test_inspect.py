"""Paths about a thing in space: how fast, where to, what is seen, and what is refused before anything moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.controllers.classical import load_classical
from fulmar_core.loop.rollout import roll_out_in_batch
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.metrics import episode_metrics, summary
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.references.named_paths import NAMED
from fulmar_core.tasks.references.planned_flight import Pace
from fulmar_core.worlds.scenario import load_scenario
from fulmar_core.worlds.structures import list_structures

ROBOT = load_robot("cubesat_8")
TASK = load_task("inspect")


def drawn(task, *, worlds=8, seed=3, training=False, robot=ROBOT):
    draws = Draws(seed, np.arange(worlds), np.zeros(worlds, dtype=int))
    return task.draw(draws, robot, training=training)


@pytest.mark.parametrize("path", NAMED)
@pytest.mark.parametrize("thing", list_structures())
def test_every_path_about_every_thing_can_be_flown_and_keeps_out(thing, path):
    task = load_task("inspect", thing).along(path)
    task.check(ROBOT)
    flight = task.flight(ROBOT)
    bend = flight.target.acceleration() / flight.target.speed**2
    by_rule = min(0.2, np.sqrt(0.5 * ROBOT.performance.turning_acceleration / max(bend, 1e-9)))
    assert flight.target.speed == pytest.approx(by_rule)
    near = np.linalg.norm(flight.table[:, :3], axis=1).min()
    assert near == pytest.approx(1.5 * task.structures[0].half_size, rel=0.01)


@pytest.mark.parametrize("path", NAMED)
def test_the_camera_looks_at_the_thing_all_along_the_path(path):
    task = TASK.along(path)
    _, goal = drawn(task, worlds=2)
    for time in np.arange(0.0, task.episode_of(ROBOT), 3.1):
        now = task.reference_of(task.advance(goal, None, np.asarray(time)))
        state = SpatialState(*now.pose.T, *now.motion.T)
        assert np.degrees(task.pointing_error(state, ROBOT)).max() < 0.05


def test_the_body_rolls_nowhere_about_the_cameras_axis():
    _, goal = drawn(TASK)
    for time in np.arange(8.0, 60.0, 2.3):  # of a closed path the rest of a roll is spread over the round
        motion = TASK.reference_of(TASK.advance(goal, None, np.asarray(time))).motion
        assert np.abs(motion[:, 3]).max() < 0.05 * np.linalg.norm(motion[:, 3:], axis=1).min() + 1e-3


def test_a_flight_begins_on_its_path_at_rest_and_ends_at_rest_after_one_whole_round():
    start, goal = drawn(TASK)
    first = goal.targets[:, 0]
    np.testing.assert_allclose(np.stack(start.columns()[:7], axis=-1), first, atol=1e-9)
    assert len(np.unique(np.round(first[:, 0], 3))) == len(first)  # anywhere on it
    begun = TASK.reference_of(TASK.advance(goal, None, np.asarray(0.0)))
    assert np.linalg.norm(begun.motion[:, :3], axis=1).max() < 0.02
    end_s = TASK.flight(ROBOT).duration_s
    ended = TASK.reference_of(TASK.advance(goal, None, np.asarray(end_s)))
    np.testing.assert_allclose(ended.pose[:, :3], first[:, :3], atol=0.02)
    assert np.linalg.norm(ended.motion[:, :3], axis=1).max() < 0.02
    assert end_s <= TASK.episode_of(ROBOT) < end_s + 0.1


def test_a_camera_mounted_aside_is_turned_to_the_thing_instead_of_the_bodys_x_axis():
    aside = (0.0, 0.0, 0.0, 0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5))  # along the body's y
    camera = type("Camera", (), {"quat_xyzw": aside[3:]})()
    sensors = type("Sensors", (), {"camera": camera})()
    robot = type("Robot", (), {"sensors": sensors, "performance": ROBOT.performance})()
    pose = TASK.flight(robot).table[100]
    x, y, z, w = pose[3:]
    left = np.array([2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)])
    np.testing.assert_allclose(left, -pose[:3] / np.linalg.norm(pose[:3]), atol=1e-3)


def test_in_training_every_path_comes_and_some_end_within_the_episode():
    _, goal = drawn(TASK, worlds=64, training=True)
    assert goal.targets.shape[1] * TASK.spacing_s > TASK.episode_s
    late = TASK.reference_of(TASK.advance(goal, None, np.asarray(80.0)))
    moves = np.linalg.norm(late.motion[:, :3], axis=1) > 0.01
    assert TASK.flight(ROBOT, "line").duration_s < 80.0 < TASK.flight(ROBOT, "spiral").duration_s
    assert 0.4 < moves.mean() < 0.9


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"radius": 1.1}, "comes to -0.13 m from the keep-out volume"),
        ({"pace": Pace(0.2, share=0.9, fixed=0.4)}, "moves by 0.4 m/s, and tasks of 'cubesat_8' ask for 0.3"),
        ({"radius": 0.5, "pace": Pace(0.2, fixed=0.25)}, "bends so hard that 0.25 m/s takes"),
        ({"radius": 0.4, "pace": Pace(0.2, fixed=0.16)}, "turns by 17.* deg/s"),
    ],
)
def test_a_path_that_the_robot_cannot_fly_is_refused_in_one_line(change, words):
    with pytest.raises(ConfigError, match=words) as refused:
        replace(TASK, **change).check(ROBOT)
    assert "\n" not in str(refused.value)


def test_unknown_paths_and_things_are_said_with_the_nearest_name():
    with pytest.raises(UnknownNameError, match=r"unknown path 'circl'\. Did you mean 'circle'"):
        TASK.along("circl")
    with pytest.raises(UnknownNameError, match=r"unknown thing 'is'.*'iss'"):
        load_task("inspect", "is")
    with pytest.raises(ConfigError, match="task 'go_to_pose_3d' has no path to choose"):
        load_task("go_to_pose_3d").along("circle")


def test_a_thing_without_a_surface_is_refused():
    bare = replace(TASK)
    bare.__dict__["structures"] = (replace(TASK.structures[0], parts=()),)
    with pytest.raises(ConfigError, match="'gateway' has no part: there is no surface to inspect"):
        bare.check(ROBOT)


def flown(law, path, *, thing="gateway", episodes=2):
    task = load_task("inspect", thing).along(path)
    task = replace(task, episode_s=task.episode_of(ROBOT))
    controller = load_classical(ROBOT, task, law=law)
    run = roll_out_in_batch(controller, ROBOT, task, load_scenario("nominal"), episodes=episodes, seed=2026)
    return task, run


def assert_precise(task, run):
    figures = summary(run, task)
    assert figures["success_rate"] == 1.0
    assert figures["path_error_m"]["mean"] < 0.01
    assert figures["path_error_m"]["max"] < 0.05
    assert figures["pointing_error_deg"]["mean"] < 0.5
    assert figures["least_distance_m"]["min"] > 0.3
    assert figures["coverage"]["mean"] is None


def test_the_pd_flies_a_whole_round_within_a_centimetre_and_half_a_degree():
    assert_precise(*flown("pd", "line"))


@pytest.mark.slow
@pytest.mark.parametrize("law", ["pd", "lqr"])
@pytest.mark.parametrize("path", NAMED)
def test_laws_fly_every_path_within_a_centimetre_and_half_a_degree(law, path):
    assert_precise(*flown(law, path))


def test_figures_of_an_inspection_come_from_the_true_states():
    task, run = flown("pd", "line", episodes=1)
    figures = episode_metrics(run, task)
    place = np.stack((run.x, run.y, run.z), axis=-1)[0].astype(float)
    outside = np.linalg.norm(place, axis=-1) - task.keep_outs[0].radius
    assert figures["least_distance_m"][0] == pytest.approx(outside.min(), abs=1e-5)
    assert figures["path_error_most_m"][0] == pytest.approx(run.position_error.max())
    x, y, z, w = run.qx[0], run.qy[0], run.qz[0], run.qw[0]
    axis = np.stack((1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)), axis=-1)
    cosine = np.sum(axis * -place, axis=-1) / np.linalg.norm(place, axis=-1)
    angle = np.degrees(np.arccos(cosine.clip(-1.0, 1.0)))
    assert figures["pointing_error_deg"][0] == pytest.approx(angle.mean(), abs=0.02)


def test_without_a_thing_trajectories_have_no_column_of_one():
    task = load_task("go_to_position_3d")
    task = replace(task, episode_s=5.0)
    controller = load_classical(ROBOT, task, law="pd")
    run = roll_out_in_batch(controller, ROBOT, task, load_scenario("nominal"), episodes=1, seed=1)
    assert run.keep_out_distance is None and "qw" not in run.columns
    assert "path_error_m" not in episode_metrics(run, task)


def test_a_path_shorter_than_its_ease_is_flown_without_a_jump():
    flight = replace(TASK, pace=Pace(speed=0.2, ease_s=90.0)).along("line").flight(ROBOT)
    rounds = flight.rounds(np.arange(0.0, flight.duration_s, 0.05))
    assert (np.diff(rounds) >= -1e-12).all()
    assert np.diff(rounds).max() < 2.0 * 0.05 / flight.target.round_s
