"""Waypoints reached against what physics allows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import Episode, draw_episodes
from fulmar_core.states.planar import at_rest
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_at, stack_goals
from fulmar_core.worlds.scenario import load_scenario
from fulmar_evaluation.figures import FIGURES
from fulmar_evaluation.waypoint_score import WaypointBound, bound_figures, has_bound, waypoint_bound

TASK = load_task("go_through_positions")
RADIUS = TASK.tolerance.position


def to_and_fro(robot, distance):
    """One episode that starts at the second of two waypoints."""
    drawn = draw_episodes(robot, TASK, load_scenario("nominal"), seed=1, numbers=np.arange(1))
    start = at_rest(np.array([distance]), np.zeros(1), np.zeros(1))
    return Episode(start, stack_goals([goal_at((0.0, 0.0, 0.0), (distance, 0.0, 0.0))]), drawn.world)


@pytest.mark.slow
def test_wheels_are_bounded_by_their_top_speed_and_by_how_fast_they_turn():
    robot = load_robot("turtlebot2")
    bound = waypoint_bound(robot, TASK, to_and_fro(robot, 4.0), 60.0)
    way = 60.0 * robot.performance.top_speed
    first, leg = 4.0 - RADIUS, 4.0 - 2.0 * RADIUS
    assert bound.goals_at_top_speed.tolist() == [1 + int((way - first) // leg)]
    assert np.all(bound.goals <= bound.goals_at_top_speed)
    assert bound.name == "turn_limited"


def test_thrusters_are_bounded_by_their_acceleration_and_by_no_speed():
    robot = load_robot("floating_platform")
    fast = replace(robot, body=replace(robot.body, mass=robot.body.mass / 4.0))
    bounds = [waypoint_bound(one, TASK, to_and_fro(one, 4.0), 60.0) for one in (robot, fast)]
    assert bounds[0].goals[0] < bounds[1].goals[0] <= 2 * bounds[0].goals[0] + 1
    assert "0.188 m/s²" in bounds[0].rule
    assert bounds[0].goals_at_top_speed is None, "air has no top speed"


def test_tasks_without_waypoints_have_no_bound():
    assert has_bound(TASK)
    for task in (
        "go_to_pose",
        "track_velocities",
        "go_to_position_with_obstacles",
        "race_gates",
        "push_block",
    ):
        assert not has_bound(load_task(task))


def test_a_share_is_goals_over_the_bound_of_the_same_episode():
    bound = WaypointBound(np.array([4, 5, 0]), np.array([8, 5, 1]), "turn_limited", "a rule")
    figures = bound_figures(np.array([3.0, 5.0, 0.0, 2.0]), bound)
    np.testing.assert_array_equal(figures["goals_bound"], [4.0, 5.0, 0.0, np.nan])
    np.testing.assert_array_equal(figures["share_of_bound"], [0.75, 1.0, np.nan, np.nan])
    np.testing.assert_array_equal(figures["share_at_top_speed"], [0.375, 1.0, 0.0, np.nan])
    assert set(figures) <= set(FIGURES)
