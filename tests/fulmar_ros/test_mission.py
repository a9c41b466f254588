"""Goals, obstacles and blocks as a controller receives them, and how far its loop has come."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fulmar_bags.message_reader import obstacles_of
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.loop.mission import Mission
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.states.planar import at_rest
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_at
from fulmar_core.tasks.observation import Observer
from fulmar_core.worlds.scenario import load_scenario
from fulmar_ros.goal_messages import obstacles_message

S = 1_000_000_000
ROBOT = load_robot("turtlebot2")


class Idle:
    """Stands still."""

    name, control_hz, estimator = "idle", ROBOT.timing.control_hz, None
    readings, observer = (), None

    def reset(self): ...

    def act(self, inputs):
        return np.zeros_like(inputs.previous)


class Followed(Mission):
    """A mission, with the control loop that follows its goal."""

    def __init__(self, task, **how):
        self.loop = ControlLoop(ROBOT, task, Idle())
        super().__init__(self.loop, **how)

    def observe(self, state, stamp_ns):
        return self.loop.inputs(state, {}, stamp_ns).observation[0]


def mission(task, **how):
    return Followed(load_task(task), **how)


def at(x, y=0.0, yaw=0.0):
    return at_rest(*(np.array([value], dtype=float) for value in (x, y, yaw)))


def test_a_mission_lacks_its_goal_first_then_what_stands_about():
    reported = mission("go_to_position_with_obstacles")
    assert reported.lacking == "goal"
    reported.give(goal_at((1.0, 0.0, 0.0)), 1)
    assert reported.lacking == "obstacles"
    reported.see_obstacles(np.array([[0.5, 0.0, 0.1]]), 2)
    assert not reported.lacking


@pytest.mark.parametrize("number", range(3))
def test_obstacles_and_goal_from_the_wires_are_observed_as_those_of_the_batch(number):
    reported, task = mission("go_to_position_with_obstacles"), load_task("go_to_position_with_obstacles")
    episode = draw_episode(ROBOT, task, load_scenario("nominal"), seed=3, number=number)
    discs, problem = obstacles_of(obstacles_message(episode.goal.obstacles, 7))
    assert problem == ""
    reported.give(goal_at((*episode.goal.current[:2], 0.0)), 1)
    reported.see_obstacles(discs, 7)
    start = episode.start
    seen = reported.observe(at(start.x, start.y, start.yaw), S)
    expected = Observer(ROBOT, task)(start, episode.goal, np.zeros(2))
    assert len(discs) > 1
    np.testing.assert_allclose(seen, expected, rtol=0, atol=1e-9)


def test_a_waypoint_is_reached_as_near_as_the_robot_can_state():
    reported, reach = mission("go_through_positions"), load_task("go_through_positions").reach
    reported.give(goal_at((0.0, 0.0, 0.0), (3.0, 0.0, 0.0)), 1)
    reported.observe(at(1.0), S)
    reported.observe(at(reach + 0.02), 2 * S)
    assert reported.done == 1


def test_the_block_of_each_state_is_waited_for():
    reported = mission("push_block")
    reported.give(goal_at((1.0, 0.0, 0.0)), 1)
    assert reported.lacking == "place of the block"
    reported.see_thing("block", np.array([0.5, 0.0, 0.0]), 3 * S)
    assert not reported.lacking
    assert reported.lacks_something_of(4 * S)
    assert not reported.lacks_something_of(3 * S)


def test_the_geofence_is_about_the_robot_where_a_block_has_to_get_to_a_place():
    reported = mission("push_block")
    reported.give(goal_at((1.0, 0.0, 0.0)), 1)
    reported.see_thing("block", np.array([0.5, 0.0, 0.0]), 3 * S)
    assert reported.distance(at(21.0)) == pytest.approx(20.0)
    reported.see_thing("block", np.array([31.0, 0.0, 0.0]), 4 * S)
    assert reported.distance(at(21.0)) == pytest.approx(30.0)


def test_a_block_that_nobody_has_seen_for_long_is_lacking_until_it_is_seen_again():
    reported = mission("push_block")
    reported.give(goal_at((1.0, 0.0, 0.0)), 1)
    reported.see_thing("block", np.array([0.5, 0.0, 0.0]), 3 * S)
    reported.turn_to(4 * S)
    assert not reported.lacking
    reported.turn_to(4 * S + 1)
    assert reported.lacking == "place of the block"
    reported.see_thing("block", np.array([0.5, 0.0, 0.0]), 5 * S)
    assert not reported.lacking


def test_waypoints_give_way_when_the_robot_is_at_them():
    reported = mission("go_through_positions")
    reported.give(goal_at((0.0, 0.0, 0.0), (3.0, 0.0, 0.0)), 1)
    assert reported.distance(at(1.0)) == pytest.approx(1.0)
    for step, x in enumerate((1.0, 0.5, 0.05)):
        reported.observe(at(x), step * S)
    assert reported.done == 1
    assert reported.distance(at(0.05)) == pytest.approx(2.95)


@pytest.mark.parametrize("begins_at", [-0.5, 6.0])
def test_gates_are_passed_by_the_way_between_two_observations(begins_at):
    """From wherever the goal found the robot, near the world's origin or far off."""
    reported = mission("race_gates")
    gates = [begins_at + ahead for ahead in (0.5, 2.1, 4.1)]
    reported.give(goal_at(*((x, 0.0, 0.0) for x in gates)), 1)
    passed = []
    for i, x in enumerate(np.arange(begins_at, begins_at + 5.0, 0.2)):
        reported.observe(at(x, 0.1), (i + 1) * S)
        passed.append((x, reported.done))
    assert [done for _, done in passed] == [sum(x >= gate for gate in gates) for x, _ in passed]


def test_a_gate_behind_the_robot_is_not_passed_by_where_it_was_before_the_goal():
    reported = mission("race_gates")
    reported.give(goal_at((0.2, 0.0, 0.0), (3.0, 0.0, 0.0)), 1)
    for i, x in enumerate((0.4, 0.6)):
        reported.observe(at(x), (i + 1) * S)
    assert reported.done == 0


def test_a_new_goal_begins_anew_and_a_streamed_one_only_where_it_differs():
    course = goal_at((0.0, 0.0, 0.0), (3.0, 0.0, 0.0))
    for streamed, done in ((False, 0), (True, 1)):
        reported = mission("go_through_positions", streamed=streamed)
        assert reported.give(course, 1)
        for step in range(2):
            reported.observe(at(0.0), step * S)
        assert reported.give(course, 2) is not streamed
        assert reported.done == done
        assert reported.give(goal_at((9.0, 0.0, 0.0)), 3)
        assert reported.done == 0


def test_a_goal_that_is_repeated_with_its_stamp_changes_nothing():
    course = goal_at((0.0, 0.0, 0.0), (3.0, 0.0, 0.0))
    reported = mission("go_through_positions")
    assert reported.give(course, 1)
    for step in range(2):
        reported.observe(at(0.0), step * S)
    assert not reported.give(course, 1)
    assert reported.done == 1
    assert reported.give(goal_at((9.0, 0.0, 0.0)), 2)
    assert not reported.give(course, 1)  # the one before, for a subscriber that came late
    assert reported.give(goal_at((5.0, 0.0, 0.0)), 2)  # the same stamp, another goal
    assert reported.give(course, 0)
    assert reported.give(course, 0)  # without a stamp, each is new


def test_a_velocity_that_is_repeated_does_not_end_those_that_follow_it():
    reported = mission("track_velocities")
    for second in (1, 2):
        reported.give(goal_at((0.1 * second, 0.0, 0.0)), second * S)
    reported.turn_to(2 * S)
    reported.give(goal_at((0.1, 0.0, 0.0)), 1 * S)
    reported.turn_to(3 * S)
    assert float(reported.observe(at(0.0), 3 * S)[0]) == pytest.approx(0.2)


def test_a_goal_that_was_dropped_or_refused_is_void_until_it_comes_with_a_new_stamp():
    goal, other = goal_at((1.0, 0.0, 0.0)), goal_at((2.0, 0.0, 0.0))
    reported = mission("go_to_position")
    reported.give(goal, 1)
    assert not reported.is_void(goal, 1)
    reported.drop()
    reported.drop()
    reported.refuse(other, 2)
    assert reported.is_void(goal, 1)
    assert reported.is_void(other, 2)
    assert not reported.is_void(goal, 3)
    assert not reported.is_void(other, 0)


def test_a_streamed_goal_of_each_state_is_waited_for():
    reported = mission("go_to_position", streamed=True)
    reported.give(goal_at((1.0, 0.0, 0.0)), 3 * S)
    assert reported.lacks_something_of(4 * S)
    assert not reported.lacks_something_of(3 * S)
    reported.refuse(goal_at((1.0, 0.0, 0.0)), 4 * S)  # under an e-stop lock step goes on
    reported.drop()
    assert not reported.lacks_something_of(4 * S)


def test_velocities_begin_when_their_stamps_say():
    reported = mission("track_velocities")
    for second in (1, 3):
        assert not reported.give(goal_at((0.1 * second, 0.0, 0.0)), second * S)
    assert reported.lacking
    seen = []
    for second in (1, 2, 3):
        reported.turn_to(second * S)
        seen.append(float(reported.observe(at(0.0), second * S)[0]))
    assert seen == pytest.approx([0.1, 0.1, 0.3])
    assert reported.distance(at(100.0)) == 0.0


@pytest.mark.parametrize("turned_to", [0, 1])
def test_no_velocity_of_before_an_emergency_stop_comes_back_after_it(turned_to):
    """Neither the one that goes on, nor one that would begin later, nor one that had only just come."""
    reported = mission("track_velocities")
    reported.give(goal_at((0.3, 0.0, 0.0)), S)
    reported.give(goal_at((0.6, 0.0, 0.0)), 3 * S)
    if turned_to:
        reported.turn_to(S)
        assert reported.lacking == ""
    reported.drop()
    for time_ns in (S + 1, 2 * S, 3 * S, 10 * S):
        reported.turn_to(time_ns)
        assert reported.lacking == "goal"
    reported.give(goal_at((-0.1, 0.0, 0.0)), 11 * S)
    reported.turn_to(11 * S)
    assert float(reported.observe(at(0.0), 11 * S)[0]) == pytest.approx(-0.1)


def test_nothing_is_near_before_everything_is_known():
    assert mission("go_to_pose").distance(at(0.0)) == math.inf
