"""Tasks whose targets are passed one after another: waypoints, poses and gates, on courses and tracks."""

from __future__ import annotations

import itertools
from dataclasses import fields, replace

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.trajectories import TargetCounter
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import Goal
from fulmar_core.tasks.race_gates import LAST, crossings
from fulmar_core.tasks.references.race_track import draw_corners
from fulmar_core.tasks.waypoint_courses import RaceTrack, WaypointCourse, headings_along
from fulmar_core.tasks.waypoint_tasks import WaypointTask

NAMES = ("go_through_positions", "go_through_poses", "race_waypoints", "race_wayposes", "race_gates")
TASKS = {name: load_task(name) for name in NAMES}
EACH = pytest.mark.parametrize("task", TASKS.values(), ids=TASKS)
WITH_HEADINGS = pytest.mark.parametrize("name", ["go_through_poses", "race_wayposes"])
GATES, POSITIONS = TASKS["race_gates"], TASKS["go_through_positions"]
BASE = load_robot("turtlebot2")
MANY = 2000
SQUARE = ((0.0, 0.0, 0.0), (2.0, 0.0, np.pi / 2), (2.0, 2.0, np.pi), (0.0, 2.0, -np.pi / 2))


def draws(count=MANY, seed=1):
    return Draws(seed, np.arange(count), np.zeros(count))


def body(x=0.0, y=0.0, yaw=0.0, vx=0.0, vy=0.0, yaw_rate=0.0):
    return PlanarState(*(np.array([float(value)]) for value in (x, y, yaw, vx, vy, yaw_rate)))


def reward(task, before, after, goal):
    """Reward of one control step whose end is measured without error."""
    return float(task.reward(before, after, goal, task.advance(goal, after, np.zeros(1)))[0])


def square(done=0.0, place=(-1.0, 0.0)):
    return Goal(np.array([SQUARE]), np.array([done]), np.zeros((1, 0, 3)), {LAST: np.array([[*place, 0.0]])})


@EACH
def test_names_state_what_is_in_the_columns(task):
    state = body(-1.0, 0.0, np.pi / 2, vx=0.3, vy=0.1, yaw_rate=0.2)
    seen = dict(zip(task.observation_names, task.observe(state, square()), strict=True))
    expected = {
        "velocity_x_in_body": 0.1,
        "velocity_y_in_body": -0.3,
        "yaw_rate": 0.2,
        "goal_direction_x_in_body": 0.0,
        "goal_direction_y_in_body": -1.0,
        "goal_distance": 1.0,
        "next_goal_direction_x_in_body": 0.0,
        "next_goal_direction_y_in_body": -1.0,
        "next_goal_distance": 3.0,
        "goal_cos_heading_error": 0.0,
        "goal_sin_heading_error": -1.0,
        "next_goal_cos_heading_error": 1.0,
        "next_goal_sin_heading_error": 0.0,
        "goal_after_next_direction_x_in_body": 2.0 / np.sqrt(13.0),
        "goal_after_next_direction_y_in_body": -3.0 / np.sqrt(13.0),
        "goal_after_next_distance": np.sqrt(13.0),
        "goal_after_next_cos_heading_error": 0.0,
        "goal_after_next_sin_heading_error": 1.0,
    }
    assert {name: float(value[0]) for name, value in seen.items()} == pytest.approx(
        {name: expected[name] for name in task.observation_names}, abs=1e-12
    )


def test_as_many_terms_are_seen_as_the_public_tasks_have_but_three_positions():
    # RoboRAN: 3 + 3 n, 3 + 5 n; n = 2, and 3 gates.
    widths = [len(TASKS[name].observation_names) for name in NAMES]
    assert widths == [12, 13, 9, 13, 18]


def test_a_position_within_reach_is_done_whichever_way_one_looks():
    for yaw in (0.0, 2.0):
        assert POSITIONS.advance(square(), body(0.16, 0.0, yaw), 0.0).done.tolist() == [1.0]
    assert POSITIONS.advance(square(), body(0.18), 0.0).done.tolist() == [0.0]


def test_evaluation_counts_by_the_tolerance_and_a_controller_by_its_radius():
    counter = TargetCounter(POSITIONS, square(), 0.1)
    assert counter.update(body(0.18)).done.tolist() == [1.0]
    assert POSITIONS.advance(square(), body(0.18), 0.0).done.tolist() == [0.0]


def knowing_its_place(std):
    odometry = replace(BASE.sensors.odometry, position=replace(BASE.sensors.odometry.position, std=std))
    return replace(BASE, sensors=replace(BASE.sensors, odometry=odometry))


@pytest.mark.parametrize("name", NAMES[:4])
@pytest.mark.parametrize(("std", "reach"), [(0.0, 0.2), (0.002, 0.194), (0.01, 0.17), (0.05, 0.17)])
def test_who_knows_its_place_better_takes_more_for_reached(name, std, reach):
    assert TASKS[name].fitted(knowing_its_place(std)).reach == pytest.approx(reach)


def test_everyone_keeps_as_far_off_the_posts_of_gates():
    assert GATES.fitted(knowing_its_place(0.0)) == GATES


def test_tasks_without_a_reach_are_the_same_for_everyone():
    task = load_task("go_to_pose")
    assert task.fitted(BASE) is task


@WITH_HEADINGS
def test_a_pose_is_done_where_place_and_heading_are_right_at_once(name):
    task = TASKS[name]
    for degrees, done in ((0.0, 1.0), (11.0, 1.0), (-11.0, 1.0), (13.0, 0.0), (180.0, 0.0)):
        assert task.advance(square(), body(0.1, 0.0, np.deg2rad(degrees)), 0.0).done.tolist() == [done]
    assert task.counted(square(), body(0.18, 0.0, np.deg2rad(14.0)), 0.0).done.tolist() == [1.0]
    assert task.counted(square(), body(0.18, 0.0, np.deg2rad(16.0)), 0.0).done.tolist() == [0.0]


@EACH
def test_after_the_last_target_the_first_comes_again(task):
    assert task.errors(body(0.0, 0.0), square(done=4.0)).position.tolist() == [0.0]
    assert task.errors(body(0.0, 0.0), square(done=5.0)).position.tolist() == [2.0]


def through(before, after, **kwargs):
    forward, backward = crossings(
        np.array([before[0]]), np.array([before[1]]), body(*after), np.array([SQUARE[0]]), 0.375
    )
    return bool(forward[0]), bool(backward[0])


def test_a_gate_is_passed_where_the_way_crosses_the_line_between_its_posts():
    assert through((-0.2, 0.0), (0.1, 0.0)) == (True, False)
    assert through((-0.2, 0.3), (0.1, 0.3)) == (True, False)
    assert through((-0.2, 0.4), (0.1, 0.4)) == (False, False)  # past the post
    assert through((-0.1, 0.6), (0.1, 0.1)) == (True, False)  # it is the crossing that counts, at 0.35
    assert through((-0.3, 0.1), (-0.1, 0.1)) == (False, False)  # not yet
    assert through((0.0, 0.0), (0.3, 0.0)) == (False, False)  # behind it already


def test_a_gate_passed_from_behind_is_no_gate_passed():
    assert through((0.1, 0.0), (-0.2, 0.0)) == (False, True)
    assert through((0.1, 0.5), (-0.2, 0.5)) == (False, False)


def test_who_is_carried_through_a_gate_has_not_passed_it():
    assert through((-0.8, 0.0), (0.8, 0.0)) == (False, False)


def test_a_gate_s_direction_turns_with_it():
    gate = np.array([[1.0, 1.0, np.pi / 2]])
    up, down = crossings(np.array([1.1]), np.array([0.9]), body(1.1, 1.2), gate, 0.375)
    assert (bool(up[0]), bool(down[0])) == (True, False)


def test_gates_are_counted_step_by_step_and_once_each():
    goal, counter = square(), TargetCounter(GATES, square(), 0.1)
    for x in np.linspace(-1.0, 1.0, 21)[1:]:
        goal = GATES.advance(goal, body(x, 0.1), 0.0)
        counter.update(body(x, 0.1))
        assert goal.done.tolist() == [1.0 if x >= 0.0 else 0.0]
        assert goal.things[LAST][:, :2].tolist() == [[x, 0.1]]
    for x in np.linspace(1.0, -1.0, 21):  # back again: the next gate is another one
        goal = GATES.advance(goal, body(x, 0.1), 0.0)
    assert goal.done.tolist() == counter.goal.done.tolist() == [1.0]


def test_between_controller_and_post_is_a_margin_that_only_evaluation_counts():
    near_the_post = square(place=(-0.1, 0.36))
    assert GATES.advance(near_the_post, body(0.1, 0.36), 0.0).done.tolist() == [0.0]
    assert GATES.counted(near_the_post, body(0.1, 0.36), 0.0).done.tolist() == [1.0]


def gate_reward(before, after):
    return reward(GATES, body(*before), body(*after), square(place=before[:2]))


def test_passing_a_gate_pays_and_passing_it_in_reverse_costs():
    w = GATES.reward_weights
    assert gate_reward((-0.1, 0.0), (0.1, 0.0)) > w.reached
    assert gate_reward((0.1, 0.0, np.pi), (-0.1, 0.0, np.pi)) < -0.3 * w.reverse
    # Around both ends and through in reverse must never pay, however often.
    loop = [(0.1, 0.0), (-0.1, 0.0), (-0.1, 0.5), (0.1, 0.5), (0.1, 0.0)]
    assert sum(gate_reward(a, b) for a, b in itertools.pairwise(loop)) < -0.5 * w.reverse


def test_behind_a_gate_the_way_to_it_leads_around():
    towards_the_post, through_it = gate_reward((1.0, 0.0), (0.9, 0.6)), gate_reward((1.0, 0.0), (0.9, 0.0))
    assert gate_reward((1.0, 0.0), (0.5, 0.0)) > gate_reward((1.0, 0.0), (1.5, 0.0))
    assert towards_the_post < through_it + 1.0  # no wall, only a longer way


@EACH
def test_coming_nearer_pays_and_reaching_pays_more(task):
    def going(a, b):
        return reward(task, body(a), body(b), square(place=(a, 0.0)))

    assert going(-1.0, -0.9) > going(-1.0, -1.0) > going(-1.0, -1.1)
    last = 0.05 if task is GATES else -0.1
    assert going(-0.2, last) > going(-0.4, -0.3) + 0.5 * task.reward_weights.reached


@EACH
def test_reaching_pays_when_it_is_measured_and_not_before(task):
    """A learner's goal advances by odometry, which may see a target reached later or sooner than the truth."""
    goal, before, after = square(place=(-0.2, 0.0)), body(-0.2), body(0.05)
    seen = task.advance(goal, after, np.zeros(1))
    paid, unpaid = (float(task.reward(before, after, goal, ended)[0]) for ended in (seen, goal))
    assert seen.done.tolist() == [1.0]
    assert paid > unpaid + 0.5 * task.reward_weights.reached


@WITH_HEADINGS
def test_looking_the_right_way_pays_near_a_pose(name):
    def turning(yaw):
        return reward(TASKS[name], body(-0.3, 0.0, 0.4), body(-0.3, 0.0, yaw), square())

    assert turning(0.2) > turning(0.4) > turning(0.6)


@WITH_HEADINGS
def test_coming_in_along_the_heading_pays_and_being_in_front_of_a_pose_is_farther_than_behind_it(name):
    def progress(a, b):
        return reward(TASKS[name], body(*a), body(*b), square())

    # Nothing but the way differs: both look ahead, and both stand 1 m off.
    assert (
        progress((1.0, 0.0), (-1.0, 0.0))
        > progress((-1.0, 0.0), (-1.0, 0.0))
        > progress((-1.0, 0.0), (1.0, 0.0))
    )
    weight = TASKS[name].reward_weights.progress
    bearing = TASKS[name].reward_weights.bearing
    gain = progress((-1.0, 0.0), (-0.9, 0.0)) - progress((-1.0, 0.0), (-1.0, 0.0))
    assert gain == pytest.approx(0.1 * weight, abs=0.02 + bearing)


@EACH
def test_starts_lie_at_the_distance_of_the_task_and_within_its_cone(task):
    start, goal = task.draw(draws(), BASE, training=False)
    dx, dy = start.x - goal.targets[:, 0, 0], start.y - goal.targets[:, 0, 1]
    low, high = task.start_distance
    assert low <= np.hypot(dx, dy).min() < low + 0.1
    assert high - 0.1 < np.hypot(dx, dy).max() <= high
    behind = np.arctan2(dy, dx) - goal.targets[:, 0, 2] - np.pi
    off = np.abs(np.rad2deg(np.arctan2(np.sin(behind), np.cos(behind))))
    assert task.start_cone_deg - 1.0 < off.max() <= task.start_cone_deg + 1e-6
    assert not goal.done.any()


def test_gates_begin_where_the_robot_is():
    start, goal = GATES.draw(draws(50), BASE, training=False)
    np.testing.assert_array_equal(goal.things[LAST], np.stack((start.x, start.y, start.yaw), axis=-1))


@EACH
def test_targets_look_from_the_one_before_to_the_one_after(task):
    targets = task.draw(draws(50), BASE, training=False)[1].targets
    np.testing.assert_array_equal(targets[..., 2], headings_along(targets[..., :2]))
    before, after = targets[:, -2, :2], targets[:, 0, :2]
    np.testing.assert_allclose(targets[:, -1, 2], np.arctan2(*(after - before).T[::-1]), rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["go_through_positions", "go_through_poses"])
def test_random_waypoints_keep_their_spacing_and_square_also_where_they_close(name):
    course = TASKS[name].course
    places = course.draw(draws())
    assert places.shape == (MANY, course.count, 2)
    assert np.abs(places).max() <= 0.5 * course.area
    leg = np.linalg.norm(np.roll(places, -1, axis=1) - places, axis=-1)
    low, high = course.spacing
    strays = np.any((leg < low - 1e-9) | (leg > high + 1e-9), axis=1)
    assert np.mean(strays) < 1e-3  # where no candidate fits, the first is moved into the square


def test_every_track_is_driven_around_its_middle_once_and_keeps_to_its_square():
    for name in ("race_waypoints", "race_wayposes", "race_gates"):
        track = TASKS[name].track
        places = track.draw(draws())
        assert places.shape == (MANY, track.corners[1], 2)
        assert np.abs(places).max() <= 0.5 * track.size
        bearing = np.arctan2(places[..., 1], places[..., 0])
        step = np.mod(np.roll(bearing, -1, axis=1) - bearing, 2 * np.pi)
        assert np.all(step > 0.0)
        np.testing.assert_allclose(step.sum(axis=1), 2 * np.pi, rtol=0, atol=1e-9)


def test_no_straight_of_a_track_is_longer_than_the_smallest_geofence_and_no_two_waypoints_touch():
    for name in ("race_waypoints", "race_wayposes", "race_gates"):
        places = TASKS[name].track.draw(draws())
        leg = np.linalg.norm(np.roll(places, -1, axis=1) - places, axis=-1)
        assert leg.max() < load_robot("floating_platform").limits.geofence
        assert leg.min() > 0.75


def test_corners_turn_back_no_more_than_the_public_tracks_allow():
    corners, count = draw_corners(draws(), fewest=9, most=13, size=15.0)
    assert set(count) == {9, 10, 11, 12, 13}
    for n in range(9, 14):
        some = corners[count == n][:, :n]
        out = np.roll(some, -1, axis=1) - some
        into = np.roll(out, 1, axis=1)
        angle = np.arctan2(
            into[..., 0] * out[..., 1] - into[..., 1] * out[..., 0], np.sum(into * out, axis=-1)
        )
        assert np.abs(np.rad2deg(angle)).max() < 180.0 - 12.5


def test_a_track_of_fewer_corners_has_the_middles_of_its_longest_straights_too():
    track = RaceTrack((9, 13), 15.0)
    places = track.draw(draws())
    corners, count = draw_corners(draws(), fewest=9, most=13, size=15.0)
    for world in range(50):
        n, mine = count[world], corners[world, : count[world]]
        after = np.roll(mine, -1, axis=0)
        longest = np.sort(np.argsort(-np.linalg.norm(after - mine, axis=1))[: 13 - n])
        expected = []
        for i in range(n):
            expected.append(mine[i])
            if i in longest:
                expected.append(0.5 * (mine[i] + after[i]))
        np.testing.assert_allclose(places[world], expected, rtol=0, atol=1e-12)


def test_impossible_waypoints_and_tracks_are_rejected():
    with pytest.raises(ValueError, match="'count' must be at least 2"):
        WaypointCourse(1, (1.0, 2.0), 5.0)
    with pytest.raises(ValueError, match="'corners' must be"):
        RaceTrack((4, 9), 15.0)
    with pytest.raises(ValueError, match="'reach' must be"):
        replace(POSITIONS, reach=0.3)
    with pytest.raises(ValueError, match="'reach_heading_deg'"):
        replace(TASKS["go_through_poses"], reach_heading_deg=20.0)
    with pytest.raises(ValueError, match="'start_cone_deg'"):
        replace(POSITIONS, start_cone_deg=200.0)


def test_a_kind_that_does_not_say_where_its_targets_lie_is_none():
    with pytest.raises(TypeError, match="places"):
        WaypointTask(**{field.name: getattr(POSITIONS, field.name) for field in fields(WaypointTask)})
