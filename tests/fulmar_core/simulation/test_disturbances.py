"""What a person may do to a simulated robot: requests that are taken and refused, and what they do."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.disturbances import (
    CLEAR,
    COMMANDS,
    DEAD,
    GUST,
    MOST,
    ODOMETRY,
    PUSH,
    STUCK,
    Disturbances,
    disturbance_choices,
    fields_of,
    read_disturbance,
)

PLATFORM, BOAT, CRAFT, SATELLITE, AIRCRAFT, CAR = (
    load_robot(name)
    for name in ("floating_platform", "kingfisher", "cubesat_8", "smallsat", "navion", "turtlebot2")
)
ALL = (PLATFORM, BOAT, CRAFT, SATELLITE, AIRCRAFT, CAR)
each = pytest.mark.parametrize("robot", ALL, ids=lambda robot: robot.name)


@each
def test_every_choice_is_taken_with_its_defaults(robot):
    for what in disturbance_choices(robot):
        assert read_disturbance({"what": what}, robot).what == what


@each
def test_choices_are_json_and_say_what_they_are_in_words(robot):
    choices = json.loads(json.dumps(disturbance_choices(robot)))
    assert all(choice["words"] for choice in choices.values())


def test_what_moves_nowhere_is_not_pushed():
    assert {PUSH, GUST}.isdisjoint(disturbance_choices(SATELLITE))
    with pytest.raises(UnknownNameError, match="unknown disturbance 'push'"):
        read_disturbance({"what": "push"}, SATELLITE)


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        ({"what": "pusch"}, "Did you mean 'push'"),
        ({"what": ["push"]}, "unknown disturbance"),
        ({}, "unknown disturbance 'None'"),
        ({"what": "dead", "actuator": "thruster_11"}, "Did you mean 'thruster_1'"),
        ({"what": "dead", "actuator": {}}, "unknown 'actuator' of 'dead'"),
        ({"what": "push", "forse_n": [1, 0]}, "Did you mean 'force_n'"),
        ({"what": "push", "force_n": [1, 0, 0]}, "must be 2 numbers"),
        ({"what": "push", "force_n": [math.nan, 0]}, "must be 2 numbers"),
        ({"what": "push", "force_n": [1e9, 0]}, "must be 2 numbers from"),
        ({"what": "push", "seconds": 10**400}, "must be a number from 0.1 to 600 s"),
        ({"what": "push", "seconds": True}, "must be a number"),
        ({"what": "push", "seconds": "2"}, "must be a number"),
        ({"what": "push", "seconds": math.inf}, "must be a number"),
        ({"what": "cut_link", "side": "odometri"}, "Did you mean 'odometry'"),
        ({"what": "cut_link", "seconds": 31}, "from 0.1 to 30 s"),
        ({"what": "stuck", "at": -0.5}, "'at' of 'stuck' is -0.5"),
    ],
)
def test_bad_requests_are_refused_in_one_clear_line(request_, words):
    with pytest.raises(ConfigError) as refusal:
        read_disturbance(request_, PLATFORM)
    assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("robot", "actuator", "share", "value"),
    [(BOAT, "left", -1.0, -1.0), (CAR, "speed", 0.5, 0.225), (AIRCRAFT, "rudder", -1.0, -0.26179939)],
    ids=["boat", "car", "aircraft"],
)
def test_a_stuck_actuator_stands_at_a_share_of_its_own_range(robot, actuator, share, value):
    stuck = read_disturbance({"what": STUCK, "actuator": actuator, "at": share}, robot)
    assert stuck.value == pytest.approx(value)


def test_no_actuator_sticks_below_its_lowest_command():
    with pytest.raises(ConfigError, match="'throttle' has no lower command"):
        read_disturbance({"what": STUCK, "actuator": "throttle", "at": -0.5}, AIRCRAFT)


@each
def test_dead_and_stuck_actuators_change_their_own_command_alone(robot):
    names, command = list(robot.actuators.names), 0.5 * robot.actuators.scale
    for what, value in ((DEAD, robot.actuators.safe_command[-1]), (STUCK, robot.actuators.scale[-1])):
        acting = Disturbances(robot)
        acting.add(read_disturbance({"what": what, "actuator": names[-1]}, robot))
        given = acting.commanded(command)
        assert given[-1] == pytest.approx(value)
        np.testing.assert_array_equal(given[:-1], command[:-1])
    np.testing.assert_array_equal(command, 0.5 * robot.actuators.scale)


def test_a_disturbance_ends_after_its_time_and_one_without_when_it_is_cleared():
    acting = Disturbances(PLATFORM)
    acting.add(read_disturbance({"what": PUSH, "seconds": 0.5}, PLATFORM))
    acting.add(read_disturbance({"what": DEAD}, PLATFORM))
    acting.advance(0.49)
    assert acting.names == (PUSH, DEAD)
    acting.advance(0.01)
    assert acting.names == (DEAD,)
    acting.advance(1e4)
    assert acting.names == (DEAD,)
    acting.add(read_disturbance({"what": CLEAR}, PLATFORM))
    assert acting.names == ()


def test_a_gust_swells_from_nothing_to_its_force_and_ebbs():
    acting = Disturbances(BOAT)
    acting.add(read_disturbance({"what": GUST, "force_n": [10.0, 0.0], "seconds": 4.0}, BOAT))
    course = []
    for _ in range(4):
        course.append(acting.force()[0])
        acting.advance(1.0)
    np.testing.assert_allclose(course, [0.0, 5.0, 10.0, 5.0], atol=1e-9)
    assert acting.force() is None


def test_two_pushes_at_once_add_up():
    acting = Disturbances(PLATFORM)
    for force in ([1.0, 0.0], [0.5, -0.5]):
        acting.add(read_disturbance({"what": PUSH, "force_n": force}, PLATFORM))
    assert acting.force() == (1.5, -0.5)


def test_a_link_is_cut_on_one_side_for_its_time():
    acting = Disturbances(PLATFORM)
    acting.add(read_disturbance({"what": "cut_link", "side": ODOMETRY, "seconds": 1.0}, PLATFORM))
    assert acting.cuts(ODOMETRY)
    assert not acting.cuts(COMMANDS)
    acting.advance(1.0)
    assert not acting.cuts(ODOMETRY)


def test_not_more_act_at_a_time_than_a_person_can_oversee():
    acting = Disturbances(PLATFORM)
    for _ in range(MOST):
        acting.add(read_disturbance({"what": DEAD}, PLATFORM))
    with pytest.raises(ConfigError, match="End them first: 'clear'"):
        acting.add(read_disturbance({"what": DEAD}, PLATFORM))
    acting.add(read_disturbance({"what": CLEAR}, PLATFORM))
    assert acting.names == ()


def test_a_record_holds_the_fields_that_a_request_left_out():
    assert fields_of({"what": "noise", "id": "1", "by": "page"}, PLATFORM) == {
        "position_m": 0.05,
        "heading_deg": 2.0,
        "seconds": 0.0,
    }
