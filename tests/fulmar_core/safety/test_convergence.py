"""A robot that commands with authority and comes no nearer to its goal."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.convergence import ConvergenceMonitor, TimeToGoal
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_at, goals_at, stack_goals
from tests.states import planar_state

DT = 0.2
PLATFORM = load_robot("floating_platform")
TASK = load_task("go_to_position")


def monitor(robot=PLATFORM, task=TASK):
    return ConvergenceMonitor(robot, task, DT)


def state_at(x):
    return TASK.state_type.from_rigid(planar_state(x, 0.0, 0.0))[None]


def pushing(share=1.0):
    command = np.zeros((1, len(PLATFORM.actuators.names)))
    command[0, 0] = share
    return command


def seconds_until_it_is_seen(watch, places, command, goal=None, limit_s=120.0):
    """When a robot is found not to converge whose place is a function of time; infinite if it is not [s]."""
    goal = goal or goals_at(np.zeros((1, 3)))
    for step in range(round(limit_s / DT)):
        target = goal(step * DT) if callable(goal) else goal
        if watch.see(state_at(places(step * DT)), target, command)[0]:
            return step * DT
    return np.inf


def test_a_robot_that_stands_although_it_is_commanded_does_not_converge():
    seen_s = seconds_until_it_is_seen(monitor(), lambda _: 1.0, pushing())
    least_s = float(TimeToGoal(PLATFORM, TASK).of(TASK.errors(state_at(1.0), goals_at(np.zeros((1, 3)))))[0])
    assert least_s < seen_s < 6.5 + 3.0 * least_s


def test_a_robot_that_moves_away_is_found_sooner_than_one_that_stands():
    stands_s = seconds_until_it_is_seen(monitor(), lambda _: 1.0, pushing())
    leaves_s = seconds_until_it_is_seen(monitor(), lambda t: 1.0 + 0.3 * t, pushing())
    assert leaves_s < 0.85 * stands_s


def test_a_robot_at_its_goal_is_at_rest_however_much_it_is_commanded():
    assert seconds_until_it_is_seen(monitor(), lambda t: 0.08 * np.sin(t), pushing()) == np.inf


def test_a_robot_that_comes_slowly_nearer_converges():
    assert seconds_until_it_is_seen(monitor(), lambda t: max(0.0, 3.0 - 0.04 * t), pushing()) == np.inf


def test_a_robot_that_is_not_commanded_is_not_blamed():
    assert seconds_until_it_is_seen(monitor(), lambda t: 1.0 + 0.1 * t, pushing(0.05)) == np.inf


def test_a_push_before_it_was_commanded_is_not_counted():
    watch = monitor()
    seconds_until_it_is_seen(watch, lambda t: 1.0 + 0.5 * t, pushing(0.0), limit_s=60.0)
    assert seconds_until_it_is_seen(watch, lambda t: 31.0 - 0.2 * t, pushing(), limit_s=60.0) == np.inf


def test_a_target_that_flees_is_no_fault_of_the_robot_that_follows():
    def goal(time_s):
        return goals_at(np.array([[0.3 * time_s, 0.0, 0.0]]))

    assert seconds_until_it_is_seen(monitor(), lambda t: 0.3 * t - 1.0, pushing(), goal) == np.inf


def test_a_target_that_flees_does_not_hide_a_robot_that_stands():
    def goal(time_s):
        return goals_at(np.array([[0.3 * time_s, 0.0, 0.0]]))

    assert seconds_until_it_is_seen(monitor(), lambda _: -1.0, pushing(), goal) < 30.0


def test_a_waypoint_that_is_done_gives_the_next_one_its_own_time():
    task = load_task("go_through_positions")
    watch, place, done = ConvergenceMonitor(PLATFORM, task, DT), 0.0, 0
    spots = [(3.0, 0.0, 0.0), (-3.0, 0.0, 0.0)]
    for _ in range(round(120.0 / DT)):
        goal = stack_goals([goal_at(*spots)])
        goal = type(goal)(goal.targets, np.array([float(done)]), goal.obstacles, goal.things)
        way = spots[done % 2][0] - place
        place += DT * 0.3 * np.sign(way)
        done += abs(way) < 0.1
        assert not watch.see(state_at(place), goal, pushing())[0]
    assert done > 3


@pytest.mark.parametrize("name", ["floating_platform", "kingfisher", "turtlebot2", "leatherback"])
def test_a_robot_has_longer_for_what_takes_it_longer(name):
    robot, goal = load_robot(name), goals_at(np.zeros((1, 3)))
    time = TimeToGoal(robot, TASK)
    near, far = (float(time.of(TASK.errors(state_at(x), goal))[0]) for x in (0.5, 5.0))
    assert 0.0 < near < far < 60.0
