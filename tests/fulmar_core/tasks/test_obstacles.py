"""Discs that stand about."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.dynamics.contact import outline_of
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_at, stack_goals
from fulmar_core.tasks.obstacles import clearance

TASK = load_task("go_to_position_with_obstacles")
RULE = TASK.obstacles
ROBOTS = {name: load_robot(name) for name in config_names("robots")}
MOVED = {name: robot for name, robot in ROBOTS.items() if not robot.flies}
EACH_ROBOT = pytest.mark.parametrize("robot", MOVED.values(), ids=MOVED)
MANY = 200


def draw(robot, *, training=False):
    return TASK.draw(Draws(5, np.arange(MANY), np.zeros(MANY)), robot, training=training)


def body(x=0.0, y=0.0, yaw=0.0):
    return PlanarState(*(np.asarray(float(value)) for value in (x, y, yaw, 0.0, 0.0, 0.0)))


@EACH_ROBOT
@pytest.mark.parametrize("training", [False, True])
def test_obstacles_are_clear_of_start_and_goal_and_never_overlap(robot, training):
    start, goal = draw(robot, training=training)
    discs, target = goal.obstacles, goal.current
    there = discs[..., 2] > 0.0
    reach = outline_of(robot).extent + RULE.radius
    for x, y, least in (
        (start.x, start.y, max(RULE.from_start, reach)),
        (target[:, 0], target[:, 1], max(RULE.from_goal, reach)),
    ):
        distance = np.hypot(discs[..., 0] - x[:, None], discs[..., 1] - y[:, None])
        assert distance[there].min() >= least
    gaps = np.linalg.norm(discs[:, :, None, :2] - discs[:, None, :, :2], axis=-1)
    both = there[:, :, None] & there[:, None, :] & ~np.eye(RULE.most, dtype=bool)
    assert gaps[both].min() >= max(RULE.apart, 2 * RULE.radius)
    assert not TASK.collides(start, goal, robot).any()


@EACH_ROBOT
def test_there_are_one_to_the_most_obstacles_and_all_of_one_size(robot):
    discs = draw(robot)[1].obstacles
    assert discs.shape[:2] == (MANY, RULE.most)
    count = np.sum(discs[..., 2] > 0.0, axis=1)
    assert set(np.unique(discs[..., 2])) == {0.0, RULE.radius}
    assert count.max() >= 5  # large robots leave less room
    assert count.mean() > 2.5
    assert np.mean(count >= 1) > 0.9


def test_many_of_them_are_in_the_way():
    start, goal = draw(ROBOTS["turtlebot2"])
    begin, end = np.stack((start.x, start.y), -1), goal.current[:, :2]
    along = np.linspace(0.0, 1.0, 50)[None, :, None]
    line = begin[:, None] + along * (end - begin)[:, None]
    gap = (
        np.linalg.norm(line[:, :, None] - goal.obstacles[:, None, :, :2], axis=-1)
        - goal.obstacles[:, None, :, 2]
    )
    gap = np.where(goal.obstacles[:, None, :, 2] > 0.0, gap, np.inf).min(axis=(1, 2))
    assert np.mean(gap < ROBOTS["turtlebot2"].body.radius) > 0.25


def terms(state, *discs):
    goal = goal_at((5.0, 0.0, 0.0), obstacles=np.array(discs).reshape(-1, 3))
    goal = TASK.surveyed(stack_goals([goal]), ROBOTS["turtlebot2"])[0]
    names = TASK.observation_names[-3 * RULE.seen :]
    seen = TASK.observe(state, goal)[-3 * RULE.seen :]
    return {name: float(value) for name, value in zip(names, seen, strict=True)}


def test_the_nearest_are_seen_first_in_the_body_s_frame():
    seen = terms(
        body(0.0, 0.0, np.pi / 2), (0.0, 2.0, 0.2), (1.0, 0.0, 0.2), (0.0, -1.5, 0.2), (9.0, 9.0, 0.2)
    )
    places = [(seen[f"obstacle_{i}_x_in_body"], seen[f"obstacle_{i}_y_in_body"]) for i in (1, 2, 3)]
    np.testing.assert_allclose(places, [(0.0, -1.0), (-1.5, 0.0), (2.0, 0.0)], rtol=0, atol=1e-12)
    closeness = [seen[f"obstacle_{i}_closeness"] for i in (1, 2, 3)]
    assert closeness == pytest.approx(np.exp(-np.array([0.8, 1.3, 1.8]) / 0.5))


def test_obstacles_that_are_not_there_are_far_and_their_number_changes_no_width():
    alone, one_of_two = terms(body()), terms(body(), (1.0, 0.0, 0.2), (0.5, 0.0, 0.0))
    assert max(alone[f"obstacle_{i}_closeness"] for i in (1, 2, 3)) < 1e-12
    assert one_of_two["obstacle_1_x_in_body"] == pytest.approx(1.0)
    assert one_of_two["obstacle_2_closeness"] < 1e-12
    assert one_of_two["obstacle_2_x_in_body"] == alone["obstacle_2_x_in_body"]


def gap(robot, x, y, yaw=0.0, radius=0.2):
    """Gap of a robot at the origin from a disc."""
    return float(clearance(body(yaw=yaw), np.array([[x, y, radius]]), robot))


def test_a_round_robot_is_as_far_from_a_disc_as_their_rims_are():
    base = ROBOTS["turtlebot2"]
    assert gap(base, 3.0, 4.0) == pytest.approx(5.0 - 0.2 - base.body.radius)
    assert gap(base, 0.1, 0.0) < 0.0


def test_a_long_robot_is_nearer_to_what_is_ahead_than_to_what_is_beside_it():
    boat = ROBOTS["kingfisher"]
    assert gap(boat, 2.0, 0.0) == pytest.approx(2.0 - 0.65 - 0.2)
    assert gap(boat, 0.0, 2.0) == pytest.approx(2.0 - 0.5 - 0.2)
    assert gap(boat, 0.0, 2.0, yaw=np.pi / 2) == pytest.approx(2.0 - 0.65 - 0.2)
    assert gap(boat, 0.65 + 0.3, 0.5 + 0.4) == pytest.approx(0.5 - 0.2)  # off its corner


def test_a_car_reaches_farther_ahead_of_its_rear_axle_than_behind_it():
    car = ROBOTS["leatherback"]
    assert gap(car, 2.0, 0.0) == pytest.approx(2.0 - (0.25 + car.body.footprint_x) - 0.2)
    assert gap(car, -2.0, 0.0) == pytest.approx(2.0 - (0.25 - car.body.footprint_x) - 0.2)


@EACH_ROBOT
def test_who_touches_collides_and_pays_more_the_nearer_it_comes(robot):
    reach = outline_of(robot).extent
    states = [body(x) for x in (0.0, 2.0 - 0.2 - reach - 0.05, 2.0)]
    goal = goal_at((9.0, 0.0, 0.0), obstacles=np.array([[2.0, 0.0, 0.2]]))
    costs = [float(TASK.penalty(state, goal, robot)) for state in states]
    assert costs[0] < costs[1] < costs[2]
    assert [bool(TASK.collides(state, goal, robot)) for state in (states[0], states[2])] == [False, True]
    assert costs[2] >= TASK.collision_cost


def test_a_batch_with_different_obstacles_collides_world_by_world():
    start, goal = draw(ROBOTS["turtlebot2"])
    at = replace(start, x=goal.obstacles[:, 0, 0], y=goal.obstacles[:, 0, 1])
    hit = TASK.collides(at, goal, ROBOTS["turtlebot2"])
    np.testing.assert_array_equal(hit[goal.obstacles[:, 0, 2] > 0.0], True)
