"""Whether a controller may act: severity order, with injected time."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from fulmar_core.safety.arbiter import Flags, Mode, arbitrate

MS = 1_000_000
NOW = 10_000 * MS
FINE = Flags(
    configured=True,
    activated=True,
    has_goal=True,
    last_input_ns=NOW - 100 * MS,
    input_timeout_ns=400 * MS,
    goal_distance=3.0,
    geofence=8.0,
)
# Most severe first: what goes wrong, the mode it means, and words of its reason.
LADDER = [
    ({"latched_fault": "valve 3 is stuck"}, Mode.FAULT, "valve 3 is stuck"),
    ({"configured": False}, Mode.UNCONFIGURED, "not configured"),
    ({"activated": False}, Mode.IDLE, "not activated"),
    ({"estop": "e-stop: pressed"}, Mode.ARMED, "e-stop: pressed"),
    ({"active_s": 61.0, "max_run_time_s": 60.0}, Mode.ARMED, "max_run_time of 60 s is over"),
    ({"contested": "2 nodes publish odom"}, Mode.ARMED, "2 nodes publish odom"),
    ({"last_input_ns": None}, Mode.ARMED, "no odom yet"),
    ({"last_input_ns": NOW - 620 * MS}, Mode.ARMED, "no usable odom for 620 ms (limit 400 ms)"),
    ({"input_problem": "odom is NaN"}, Mode.ARMED, "odom is NaN"),
    ({"image_problem": "no image yet"}, Mode.ARMED, "no image yet"),
    ({"outside": "the robot is outside"}, Mode.ARMED, "the robot is outside"),
    ({"bearing_off": True}, Mode.ARMED, "the air bearing is off"),
    ({"unconverged": "it comes no nearer"}, Mode.ARMED, "it comes no nearer"),
    ({"has_goal": False}, Mode.ARMED, "no goal yet"),
    ({"goal_distance": 8.1}, Mode.ARMED, "goal is 8.1 m away, beyond the geofence of 8 m"),
]


def test_when_all_is_well_the_controller_acts():
    decision = arbitrate(FINE, NOW)
    assert (decision.mode, decision.may_act, decision.reason) == (Mode.ACTIVE, True, "")


@pytest.mark.parametrize(("wrong", "mode", "words"), LADDER)
def test_each_thing_that_is_wrong_stops_it_with_its_reason(wrong, mode, words):
    decision = arbitrate(replace(FINE, **wrong), NOW)
    assert (decision.mode, decision.may_act) == (mode, False)
    assert words in decision.reason


@pytest.mark.parametrize("rung", range(len(LADDER) - 1))
def test_of_two_problems_the_more_severe_is_reported(rung):
    upper, mode, words = LADDER[rung]
    for lower, _, _ in LADDER[rung + 1 :]:
        if "last_input_ns" in upper and "input_problem" in lower:
            continue  # these two are reported together, see below
        decision = arbitrate(replace(FINE, **{**lower, **upper}), NOW)
        assert decision.mode is mode
        assert words in decision.reason


def test_a_missing_input_beside_a_goal_is_reported():
    assert arbitrate(replace(FINE, has_goal=False, lacking="obstacles"), NOW).reason == "no obstacles yet"


def test_the_geofence_and_the_timeout_themselves_are_allowed():
    assert arbitrate(replace(FINE, goal_distance=8.0, last_input_ns=NOW - 400 * MS), NOW).may_act


def test_a_stale_input_is_reported_with_the_problem_of_the_newest():
    flags = replace(FINE, last_input_ns=NOW - 500 * MS, input_problem="odom is NaN")
    assert arbitrate(flags, NOW).reason.endswith("(odom is NaN)")


def test_without_any_good_input_the_reason_is_why_the_newest_was_refused():
    flags = replace(FINE, last_input_ns=None, input_problem="odom is NaN")
    assert arbitrate(flags, NOW).reason == "odom is NaN"


def test_time_alone_takes_the_controller_off():
    assert arbitrate(FINE, NOW + 300 * MS).may_act
    assert not arbitrate(FINE, NOW + 301 * MS).may_act


def test_a_distance_that_is_not_a_number_is_beyond_the_geofence():
    assert not arbitrate(replace(FINE, goal_distance=math.nan), NOW).may_act


@hypothesis_settings(derandomize=True, deadline=None)
@given(
    configured=st.booleans(),
    activated=st.booleans(),
    fault=st.sampled_from(["", "x"]),
    goal=st.booleans(),
    age=st.one_of(st.none(), st.integers(0, 10**9)),
    problem=st.sampled_from(["", "y"]),
    distance=st.floats(),
)
def test_it_acts_exactly_when_nothing_is_wrong(configured, activated, fault, goal, age, problem, distance):
    flags = Flags(
        configured,
        activated,
        fault,
        goal,
        None if age is None else NOW - age,
        problem,
        400 * MS,
        distance,
        8.0,
    )
    fine = configured and activated and not fault and goal and age is not None and age <= 400 * MS
    decision = arbitrate(flags, NOW)
    assert decision.may_act == (fine and not problem and distance <= 8.0)
    assert decision.may_act == (decision.mode is Mode.ACTIVE) == (not decision.reason)


@pytest.mark.parametrize(
    "reason", [{"has_goal": False}, {"outside": "out"}, {"image_problem": "no image yet"}]
)
def test_the_guard_of_volumes_may_brake_unless_an_e_stop_held_the_robot_and_no_goal_came_since(reason):
    assert arbitrate(replace(FINE, **reason), NOW).may_brake
    assert not arbitrate(replace(FINE, **reason, rests=True), NOW).may_brake
