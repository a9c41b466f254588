"""The fault suite of a robot, and its results."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from fulmar_cli.commands.faults import names_in
from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_evaluation.faults import command_faults
from fulmar_evaluation.faults.fault import Fault, Outcome, stopped
from fulmar_evaluation.faults.fault_environment import plan_of
from fulmar_evaluation.faults.live_system import LiveSystem, NothingShown, live_system
from fulmar_evaluation.faults.suite import EVERY, faults_of, run_faults, times_of
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of

real_time = pytest.mark.real_time

ROBOTS = ("floating_platform", "turtlebot2", "kingfisher")
THROUGH_THE_COMMAND = ("floating_platform", "controller_killed")
SPACECRAFT = "spacecraft_16"
IN_SPACE = (  # what differs there: three axes, sixteen valves, longer ticks, an estimator of its own
    "controller_hangs",
    "estimator_hangs",
    "teleop_killed",
    "odometry_with_a_wrong_quaternion",
    "odometry_turns_too_fast",
    "odometry_leaves_the_area",
    "odometry_leaves_the_geofence",
    "goal_outside_the_area",
    "goals_killed",
    "commands_of_wrong_length",
    "commands_from_another_node",
    "bundle_refused_with_fallback",
    "swap_to_the_same_policy",
    "mocap_frozen",
    "valve_stuck_open",
    "supply_pressure_falls",
)
SATELLITE = "cubesat_wheels"
ON_A_SATELLITE = (  # what differs there: estimators in a chain, a place that does not change
    "gyroscope_dies",
    "estimator_killed",
    "odometry_frozen",
    "odometry_dated_back",
    "goals_killed",
    "goal_with_a_wrong_quaternion",
    "star_tracker_frozen",
    "star_tracker_drifts",
    "wheel_dead",
    "two_odometries",
)
AIRCRAFT = "airship_v7"
ON_AN_AIRCRAFT = (  # what differs there: it flies on, by the plant's own state
    "controller_killed",
    "controller_hangs",
    "plant_killed",
    "estop_killed",
    "odometry_not_a_number",
    "odometry_late",
    "goal_outside_the_area",
    "commands_not_a_number",
    "commands_late",
    "commands_from_another_node",
    "time_jump_backwards",
    "recorder_killed",
    "supervisor_stopped",
    "surface_stuck",  # drawn: the rudder
    "propeller_lost",
    "gnss_creeps",  # it comes down at once
)


def others() -> list:
    """Every fault that applies to a robot, but that of the quick test."""
    return [
        pytest.param(robot, fault, launcher, id=f"{robot}-{fault.name}-{launcher}")
        for robot in ROBOTS
        for fault, launcher in times_of(faults_of(robot)[0])
        if (robot, fault.name) != THROUGH_THE_COMMAND
    ]


def test_a_robot_has_the_faults_that_mean_something_to_it():
    for robot in ROBOTS:
        possible, skipped = faults_of(robot)
        assert len(possible) + len(skipped) == len(EVERY)
        assert all(one.reason for one in skipped)
    left_out = {robot: {one.name for one in faults_of(robot)[1]} for robot in ROBOTS}
    assert "commands_with_wrong_names" in left_out["turtlebot2"] - left_out["kingfisher"]
    assert "driver_killed" in left_out["floating_platform"] - left_out["turtlebot2"]


def test_faults_that_need_root_are_left_out_and_refused_where_there_is_none(monkeypatch) -> None:
    monkeypatch.setattr(command_faults, "why_not", lambda: "two hosts need root")
    possible, skipped = faults_of("turtlebot2")
    assert not {"cable_cut", "cable_lossy"} & {fault.name for fault in possible}
    assert {one.name for one in skipped if one.reason == "two hosts need root"} == {
        "cable_cut",
        "cable_lossy",
    }
    with pytest.raises(ConfigError, match="cable_cut: two hosts need root"):
        faults_of("turtlebot2", ["cable_cut"])


def test_a_fault_that_does_not_exist_is_reported_with_the_nearest():
    with pytest.raises(UnknownNameError, match="Did you mean 'controller_killed'"):
        faults_of("turtlebot2", ["controller_kiled"])


def test_a_list_of_faults_may_end_with_a_comma_and_must_name_one():
    assert names_in("controller_killed, plant_killed,") == ["controller_killed", "plant_killed"]
    assert names_in(None) is None
    for nothing in ("", " , "):
        with pytest.raises(ConfigError, match="no fault is named"):
            faults_of("turtlebot2", names_in(nothing))


@real_time
@pytest.mark.slow
def test_a_robot_that_goes_on_or_never_moved_does_not_pass_for_one_that_stopped(
    ros_domain: RosDomain, tmp_path: Path
):
    """The evaluate alone, with nothing done to the system."""
    with live_system(plan_of("floating_platform", tmp_path / "bag")) as live:
        with pytest.raises(NothingShown):
            stopped(live, time.monotonic(), 0.1)
        live.begin()
        since_s = live.until_it_moves()
        outcome = stopped(live, since_s, live.watchdog_s + live.tick_s)
    assert not outcome.passed
    assert outcome.detected_by == ""


def test_a_fault_that_cannot_be_done_says_so_and_loses_no_other(ros_domain: RosDomain) -> None:
    def impossible(_live: LiveSystem) -> Outcome:
        raise ZeroDivisionError("no way")

    fault = Fault(impossible, begins=False)
    found = run_faults("turtlebot2", [fault, fault], lambda _done: None)
    assert [finding.status for finding in found] == ["not done", "not done"]
    assert not any(finding.passed for finding in found)
    assert found[0].reaction == "ZeroDivisionError: no way"


@real_time
@pytest.mark.slow
def test_a_fault_is_survived_and_the_command_reports_all_of_it_in_json(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    robot, fault = THROUGH_THE_COMMAND
    asked = ("faults", "--robot", robot, "--only", fault, "--json")
    done = fulmar(*asked, env=ros_domain.env, cwd=tmp_path)
    report = json_of(done.stdout)
    assert list(report) == ["robot", "faults", "skipped"]
    assert report["robot"] == robot
    assert [found["launcher"] for found in report["faults"]] == ["run", "up"]
    for found in report["faults"]:
        assert found["passed"], found
        assert "controller was killed by SIGKILL" in found["launcher_ended"]
    assert done.returncode == 0


@real_time
def test_a_killed_controller_is_survived(ros_domain: RosDomain) -> None:
    """Below `fulmar run`; the command does it below both launchers, and tests/fulmar_cli has its document."""
    robot, fault = THROUGH_THE_COMMAND
    (found,) = run_faults(robot, faults_of(robot, [fault])[0], lambda _done: None, "run")
    assert found.passed, found
    assert found.bag_intact
    assert "controller was killed by SIGKILL" in str(found.launcher_ended)


@real_time
@pytest.mark.slow
@pytest.mark.timeout(240)
@pytest.mark.parametrize(("robot", "fault", "launcher"), others())
def test_every_other_fault_is_survived(
    robot: str, fault: Fault, launcher: str, ros_domain: RosDomain
) -> None:
    (found,) = run_faults(robot, [fault], lambda _done: None, launcher)
    assert found.passed, found
    assert found.bag_intact
    if fault.name == "cable_cut" and robot == "floating_platform":
        assert found.limit_s == pytest.approx(0.42)
        assert found.detected_by == "plant"


def check_all(robot: str, fault: str) -> None:
    """A fault is survived under every launcher under which it is done."""
    for found in run_faults(robot, faults_of(robot, [fault])[0], lambda _done: None):
        assert found.passed, found
        assert found.bag_intact


@real_time
@pytest.mark.slow
@pytest.mark.timeout(240)
@pytest.mark.parametrize("fault", IN_SPACE)
def test_a_spacecraft_survives_what_differs_in_space(fault: str, ros_domain: RosDomain) -> None:
    check_all(SPACECRAFT, fault)


@real_time
@pytest.mark.slow
@pytest.mark.timeout(240)
@pytest.mark.parametrize("fault", ON_A_SATELLITE)
def test_a_satellite_survives_what_differs_there(fault: str, ros_domain: RosDomain) -> None:
    check_all(SATELLITE, fault)


@real_time
@pytest.mark.slow
@pytest.mark.timeout(240)
@pytest.mark.parametrize("fault", ON_AN_AIRCRAFT)
def test_an_aircraft_flies_on_level_through_what_differs_there(fault: str, ros_domain: RosDomain) -> None:
    check_all(AIRCRAFT, fault)
