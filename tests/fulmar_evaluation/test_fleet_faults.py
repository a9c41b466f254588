"""Faults of one robot of a fleet: which it can have, what its fleet then is, and what counts for the others."""

from __future__ import annotations

from pathlib import Path

import pytest

from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.robots.topics import ODOMETRY
from fulmar_evaluation.faults.fault_environment import RELAYED, FaultEnvironment
from fulmar_evaluation.faults.fleet_environment import harmed_fleet
from fulmar_evaluation.faults.fleet_suite import FLEET_FAULTS, faults_of_fleet, others_of

PROCESSES = {"controller", "recorder", "estop", "estimator", "goals", "markers"}


def test_a_robot_of_a_fleet_has_the_faults_of_processes_sensors_and_commands_and_the_rest_has_a_reason() -> (
    None
):
    possible, skipped = faults_of_fleet("fleet")
    names = {fault.name for fault in possible}
    for process in PROCESSES:
        assert {f"{process}_killed", "recorder_stopped" if process == "recorder" else f"{process}_hang"} <= {
            name.removesuffix("s") if name.endswith("hangs") else name for name in names
        }
    assert {"odometry_silent", "odometry_frozen", "commands_late", "mocap_lost", "fleet_estop"} <= names
    assert len(possible) + len(skipped) == len(FLEET_FAULTS)
    assert all(one.reason for one in skipped)
    assert "goals_killed" not in {fault.name for fault in faults_of_fleet("swap_places")[0]}


def test_a_fault_reaches_one_robot_and_leaves_the_plans_of_the_others_as_they_are(tmp_path: Path) -> None:
    usual = harmed_fleet("fleet", "beta", tmp_path / "bag")
    plan = harmed_fleet("fleet", "beta", tmp_path / "bag", FaultEnvironment(estimated=True))
    relayed = harmed_fleet("fleet", "beta", tmp_path / "bag", RELAYED)
    alpha, beta, boat = plan.robots
    assert (alpha, boat) == (usual.robots[0], usual.robots[2])
    assert beta.guards.estop and beta.guards.estimator == "mocap_imu"
    assert not alpha.guards.estop
    assert [one.intercepted for one in relayed.robots] == [
        (),
        (("plant", ODOMETRY.name, f"original/{ODOMETRY.name}"),),
        (),
    ]


def test_an_unknown_robot_or_fault_of_a_fleet_is_one_line_with_the_known_ones() -> None:
    with pytest.raises(UnknownNameError, match="Known: alpha, beta, boat"):
        faults_of_fleet("fleet", "gamma")
    with pytest.raises(UnknownNameError, match="Did you mean 'controller_killed'"):
        faults_of_fleet("fleet", "alpha", ["controller_kiled"])
    with pytest.raises(ConfigError, match="cable_cut: the processes of a fleet run on one host"):
        faults_of_fleet("fleet", "alpha", ["cable_cut"])


def test_another_robot_that_did_not_arrive_or_gave_no_result_is_named_with_the_reason() -> None:
    results = {
        "beta": {"success": True, "failure": None},
        "boat": {"success": False, "failure": None},
        "gamma": {"success": True, "failure": "controller: hangs"},
    }
    assert others_of(results, ["beta", "boat", "gamma", "delta"]) == {
        "beta": "arrived",
        "boat": "did not arrive",
        "gamma": "controller: hangs",
        "delta": "the run gave no result",
    }
