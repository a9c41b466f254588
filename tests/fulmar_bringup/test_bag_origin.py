"""A bag says which files, which policy and which code made it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from fulmar_bringup.bag_origin import attachments, run_info
from fulmar_bringup.launched_system import list_nodes
from fulmar_bringup.recorder_row import recorder_spec
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import Guards, System
from fulmar_core.config.recording import Recording
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.robots.calibration import VARIABLE, Calibration, Measured, save_calibration
from fulmar_ros.recorder_settings import RecorderSettings

LQR = RunPlan("floating_platform", "go_to_pose", "lqr", "mujoco", 50.0)
POLICY = RunPlan("floating_platform", "go_to_pose", "policy", "mujoco", 5.0)


def names(plan):
    files = json.loads(attachments(plan))
    return {name: Path(path).name for name, path in files.items() if isinstance(path, str)}


def test_a_run_of_a_law_carries_its_files_and_its_gains():
    assert names(LQR) == {
        "robot.yaml": "floating_platform.yaml",
        "task.yaml": "go_to_pose.yaml",
        "scenario.yaml": "nominal.yaml",
        "controller.yaml": "floating_platform_lqr.yaml",
    }


@pytest.mark.parametrize("controller", ["lqr", "mpc", "excite"])
def test_a_run_carries_its_settings_as_a_system_file_that_loads(tmp_path, controller):
    guards = Guards(max_run_time_s=10.0, area=(-1.0, 1.0, -2.0, 2.0))
    plan = replace(
        LQR, controller=controller, control_hz=25.0, guards=guards, recording=Recording(split_s=60.0)
    )
    file = tmp_path / "system.yaml"
    file.write_bytes(RecorderSettings(attachments=attachments(plan)).files()["system.yaml"])
    system = load_config(System, file)
    assert (system.controller, system.control_hz, system.guards) == (controller, 25.0, guards)
    assert system.recorder == plan.recording


def test_a_run_names_its_robot_beside_its_type(tmp_path):
    assert json.loads(run_info(LQR))["name"] == "floating_platform"
    named = replace(LQR, name="alpha")
    info = json.loads(run_info(named))
    assert (info["robot"], info["name"]) == ("floating_platform", "alpha")
    file = tmp_path / "system.yaml"
    file.write_bytes(RecorderSettings(attachments=attachments(named)).files()["system.yaml"])
    assert load_config(System, file).name == "alpha"


def test_a_run_of_a_policy_carries_its_passport():
    path = Path(json.loads(attachments(POLICY))["passport.json"])
    assert json.loads(path.read_text())["task"] == "go_to_pose"


def test_the_given_bundle_goes_before_the_shipped_one(tmp_path):
    plan = RunPlan("floating_platform", "go_to_pose", "policy", "mujoco", 5.0, policy=str(tmp_path))
    assert json.loads(attachments(plan))["passport.json"] == str(tmp_path / "passport.json")


@pytest.mark.parametrize(
    ("robot", "file"),
    [("turtlebot2", "turtlebot2_polar.yaml"), ("kingfisher", "kingfisher_line_of_sight.yaml")],
)
def test_the_law_of_a_family_carries_its_gains(robot, file):
    assert names(RunPlan(robot, "go_to_pose", "classical", "mock", 10.0))["controller.yaml"] == file


def test_a_calibration_in_use_is_carried_and_named(tmp_path, monkeypatch):
    calibration = tmp_path / "measured.yaml"
    save_calibration(Calibration("floating_platform", mass=Measured(5.3, 5.2, 5.4)), calibration)
    monkeypatch.setenv(VARIABLE, str(calibration))
    assert names(LQR)["calibration.yaml"] == "measured.yaml"
    assert json.loads(run_info(LQR))["calibration"] == str(calibration)


def test_an_excited_run_has_no_gains_to_carry():
    assert "controller.yaml" not in names(RunPlan("turtlebot2", "go_to_pose", "excite", "mujoco", 10.0))


def test_a_launched_system_says_as_much_as_a_run():
    recorder = list_nodes(system="mujoco_lqr")[0]
    assert json.loads(recorder.parameters["attachments"]) == json.loads(attachments(LQR))
    info = json.loads(recorder.parameters["run_info"])
    assert (info["robot"], info["controller"], info["control_hz"]) == ("floating_platform", "lqr", 50.0)
    assert "git_revision" in info


def test_run_information_is_the_plan_and_what_else_is_known():
    info = json.loads(run_info(replace(LQR, command="fulmar run")))
    assert info["command"] == "fulmar run"
    assert info["recording"]["mode"] == "whole"
    assert "supervised" not in info


def test_the_recorder_is_reported_what_differs_from_its_own_defaults():
    plan = RunPlan(
        "floating_platform",
        "go_to_pose",
        "lqr",
        "mujoco",
        50.0,
        recording=Recording(mode="ring", split_s=60.0),
    )
    assert recorder_spec(plan).parameters == {"mode": "ring", "split_s": 60.0}


def test_a_run_under_the_former_name_of_a_scenario_carries_its_file():
    former = replace(LQR, scenario="drift_stranded")  # word: old name of a scenario
    assert names(former)["scenario.yaml"] == "drift_uncontrollable.yaml"
