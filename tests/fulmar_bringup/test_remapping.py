"""Topics of a run under other names: read, checked, and given to every node."""

from __future__ import annotations

from dataclasses import replace

import pytest

from fulmar_bringup.bag_origin import run_info
from fulmar_bringup.plan_checks import read_remappings
from fulmar_bringup.plant_row import plant_spec
from fulmar_bringup.processes import command_line
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import Guards
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import ConfigError

NAME = "/vrpn_mocap/body/pose"
PLAN = RunPlan(
    "floating_platform",
    "go_to_pose",
    "lqr",
    "mujoco",
    50.0,
    goals="circle",
    guards=Guards(estimator="mocap_imu", estop=True),
    mocap_hz=200.0,
    remappings=(("mocap/pose", NAME),),
)


def test_every_node_of_a_run_gets_the_same_names():
    specs = system_rows(PLAN, record={}).values()
    assert {spec.name for spec in specs} == {"recorder", "plant", "estop", "estimator", "controller", "goals"}
    for spec in specs:
        assert f"mocap/pose:={NAME}" in command_line(spec)


def test_the_bag_names_the_new_names():
    assert f'"remappings": [["mocap/pose", "{NAME}"]]' in run_info(PLAN)


def test_the_plant_gets_the_rate_of_the_motion_capture():
    assert plant_spec(PLAN).parameters["mocap_hz"] == 200.0
    assert "mocap_hz" not in plant_spec(replace(PLAN, mocap_hz=0.0)).parameters


def test_several_topics_are_renamed():
    names = read_remappings(["mocap/pose:=/optitrack/pose", "cmd_vel:=drive"])
    assert names == {"mocap/pose": "/optitrack/pose", "cmd_vel": "drive"}


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["mocap/pose"], "must be FROM:=TO"),
        (["mocap/pos:=/x"], "unknown topic to remap 'mocap/pos'. Did you mean 'mocap/pose'"),
        (["estop:=/x"], "unknown topic to remap 'estop'"),
        (["mocap/pose:=/1x"], "'/1x' is no name of a topic"),
        (["mocap/pose:=/x", "mocap/pose:=/y"], "two names: /x and /y"),
        (["mocap/pose:=odom"], "gives two topics the name 'odom'"),
    ],
)
def test_names_that_cannot_be_are_refused(texts, message):
    with pytest.raises(ConfigError, match=message):
        read_remappings(texts)
