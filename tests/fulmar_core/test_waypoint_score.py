"""Waypoints reached against what physics allows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.episode import Episode, draw_episodes
from fulmar_core.goal import goal_at, stack_goals
from fulmar_core.planar import at_rest
from fulmar_core.robot import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.waypoint_score import shares_of_bound, waypoint_bound

TASK = load_task("go_through_positions")
RADIUS = TASK.tolerance.position


def to_and_fro(robot, distance):
    """One episode that starts at the second of two waypoints."""
    drawn = draw_episodes(robot, TASK, load_scenario("nominal"), seed=1, numbers=np.arange(1))
    start = at_rest(np.array([distance]), np.zeros(1), np.zeros(1))
    return Episode(start, stack_goals([goal_at((0.0, 0.0, 0.0), (distance, 0.0, 0.0))]), drawn.world)


def test_wheels_are_bounded_by_their_top_speed():
    robot = load_robot("turtlebot2")
    bound = waypoint_bound(robot, TASK, to_and_fro(robot, 4.0), 60.0)
    way = 60.0 * robot.performance.top_speed
    first, leg = 4.0 - RADIUS, 4.0 - 2.0 * RADIUS
    assert bound.goals.tolist() == [1 + int((way - first) // leg)]
    assert "0.45 m/s" in bound.rule
    assert "turning not counted" in bound.rule


def test_thrusters_are_bounded_by_their_acceleration_and_by_no_speed():
    robot = load_robot("floating_platform")
    fast = replace(robot, body=replace(robot.body, mass=robot.body.mass / 4.0))
    bounds = [waypoint_bound(one, TASK, to_and_fro(one, 4.0), 60.0) for one in (robot, fast)]
    assert bounds[0].goals[0] < bounds[1].goals[0] <= 2 * bounds[0].goals[0] + 1
    assert "0.188 m/s²" in bounds[0].rule


@pytest.mark.parametrize("task", ["go_to_pose", "track_velocities", "go_to_position_with_obstacles"])
def test_tasks_without_waypoints_have_no_bound(task):
    robot, task = load_robot("kingfisher"), load_task(task)
    drawn = draw_episodes(robot, task, load_scenario("nominal"), seed=1, numbers=np.arange(2))
    assert waypoint_bound(robot, task, drawn, 60.0) is None


def test_a_share_is_goals_over_the_bound_of_the_same_episode():
    shares = shares_of_bound(np.array([3.0, 5.0, 0.0]), np.array([4, 5, 0]))
    assert shares[:2].tolist() == [0.75, 1.0]
    assert np.isnan(shares[2]), "where nothing can be reached there is nothing to share"
