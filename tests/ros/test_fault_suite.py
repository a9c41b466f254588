"""Faults done to live systems: each stops the robot in time, and a system that nothing was done to fails the judge."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from fulmar_bringup.faults.finding import stopped
from fulmar_bringup.faults.live_system import live_system
from fulmar_bringup.faults.suite import faults_of, request_of
from fulmar_core.errors import UnknownNameError
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of

ROBOTS = ("floating_platform", "turtlebot2", "kingfisher")
QUICK = "controller_killed,odometry_not_a_number,swap_to_a_wrong_hash"
KEYS = ["name", "detected_by", "reaction", "time_to_safe_s", "limit_s", "passed"]


def test_a_command_without_names_has_no_faults_of_names():
    names = {robot: {fault.__name__ for fault in faults_of(robot)} for robot in ROBOTS}
    assert "commands_with_wrong_names" in names["floating_platform"] & names["kingfisher"]
    assert "commands_with_wrong_names" not in names["turtlebot2"]
    assert all(len(faults) == len(faults_of(robot)) for robot, faults in names.items())


def test_a_fault_that_does_not_exist_is_told_with_the_nearest():
    with pytest.raises(UnknownNameError, match="Did you mean 'controller_killed'"):
        faults_of("turtlebot2", ["controller_kiled"])


def test_a_robot_that_goes_on_does_not_pass_for_one_that_stopped(
    ros_domain: RosDomain, tmp_path: Path, monkeypatch
):
    """The judge alone, with nothing done to the system."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros_domain.id))
    with live_system(request_of("floating_platform", tmp_path / "bag")) as live:
        since_s = live.until_it_moves()
        finding = stopped(live, "nothing", since_s, live.watchdog_s + live.tick_s)
        assert live.witness.applied_since(since_s)
    assert not finding.passed
    assert finding.detected_by == ""
    assert time.monotonic() > since_s


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.parametrize("robot", ROBOTS)
def test_some_faults_of_each_robot_are_survived(robot: str, ros_domain: RosDomain, tmp_path: Path) -> None:
    done = fulmar(
        "faults",
        "--robot",
        robot,
        "--only",
        QUICK,
        "--json",
        env=ros_domain.env,
        cwd=tmp_path,
        timeout_s=280.0,
    )
    report = json_of(done.stdout)
    assert report["robot"] == robot
    assert [list(fault) for fault in report["faults"]] == [KEYS] * 3
    assert all(fault["passed"] for fault in report["faults"]), report
    assert done.returncode == 0


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_every_fault_of_the_platform_is_survived(ros_domain: RosDomain, tmp_path: Path) -> None:
    done = fulmar("faults", "--json", env=ros_domain.env, cwd=tmp_path, timeout_s=880.0)
    assert all(fault["passed"] for fault in json_of(done.stdout)["faults"]), done.stdout
