"""Faults done to live systems: each stops the robot in time, and a system that nothing was done to fails the judge."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from fulmar_bringup.faults import suite
from fulmar_bringup.faults.finding import stopped
from fulmar_bringup.faults.live_system import live_system
from fulmar_bringup.faults.suite import faults_of, request_of
from fulmar_bringup.faults.two_hosts import why_not
from fulmar_core.errors import ConfigError, UnknownNameError
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of

pytestmark = pytest.mark.real_time

QUICK = {
    "floating_platform": "disk_full",
    "turtlebot2": "time_jump_backwards",
}
ROBOTS = (*QUICK, "kingfisher")
KEYS = ["name", "detected_by", "reaction", "time_to_safe_s", "limit_s", "passed"]


def test_a_command_without_names_has_no_faults_of_names():
    names = {robot: {fault.__name__ for fault in faults_of(robot)} for robot in ROBOTS}
    assert "commands_with_wrong_names" in names["floating_platform"] & names["kingfisher"]
    assert "commands_with_wrong_names" not in names["turtlebot2"]
    assert all(len(faults) == len(faults_of(robot)) for robot, faults in names.items())


def test_faults_that_need_root_are_left_out_and_refused_where_there_is_none(monkeypatch) -> None:
    monkeypatch.setattr(suite, "why_not", lambda: "two hosts need root")
    assert not {"cable_cut", "cable_lossy"} & {fault.__name__ for fault in faults_of("turtlebot2")}
    with pytest.raises(ConfigError, match="cable_cut: two hosts need root"):
        faults_of("turtlebot2", ["cable_cut"])


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
@pytest.mark.timeout(120)
@pytest.mark.parametrize(("robot", "fault"), QUICK.items())
def test_a_fault_is_survived(robot: str, fault: str, ros_domain: RosDomain, tmp_path: Path) -> None:
    """Two kinds; `fulmar faults` does them all."""
    asked = ("faults", "--robot", robot, "--only", fault, "--json")
    done = fulmar(*asked, env=ros_domain.env, cwd=tmp_path)
    report = json_of(done.stdout)
    assert report["robot"] == robot
    (found,) = report["faults"]
    assert list(found) == KEYS
    assert found["passed"], found
    assert done.returncode == 0


@pytest.mark.slow
@pytest.mark.skipif(bool(why_not()), reason=why_not() or "never")
def test_a_cut_cable_stops_the_robot_within_the_watchdog_and_a_tick(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    done = fulmar("faults", "--only", "cable_cut", "--json", env=ros_domain.env, cwd=tmp_path)
    (found,) = json_of(done.stdout)["faults"]
    assert found["passed"], found
    assert found["limit_s"] == pytest.approx(0.42)
    assert found["detected_by"] == "plant"
