"""The table of processes: pure, and what both launchers start."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec

import pytest

from fulmar_bringup.node_table import RunPlan, controller_spec, list_nodes, plant_spec, recorder_spec
from fulmar_bringup.system import default_control_hz, load_system
from fulmar_core.errors import ConfigError, UnknownNameError
from fulmar_core.paths import config_names

PLAN = RunPlan("floating_platform", "go_to_pose", "lqr", "mujoco", 50.0)
SYSTEMS = pytest.mark.parametrize("system", config_names("systems"))


def by_name(nodes):
    return {node.name: node for node in nodes}


@SYSTEMS
def test_every_system_is_recorder_plant_and_controller_in_one_namespace(system):
    nodes = list_nodes(system=system)
    assert [node.name for node in nodes] == ["recorder", "plant", "controller"]
    assert {node.namespace for node in nodes} == {f"/{load_system(system).robot}"}


@SYSTEMS
def test_every_node_of_every_system_is_a_module_that_exists(system):
    for node in list_nodes(system=system):
        assert find_spec(node.module) is not None
        assert node.module.split(".")[0] == node.package
        assert node.module.split(".")[-1] == node.executable


@SYSTEMS
def test_plant_and_controller_get_the_rate_of_the_system_file(system):
    nodes = by_name(list_nodes(system=system))
    hz = load_system(system).control_hz
    assert nodes["plant"].parameters["control_hz"] == nodes["controller"].parameters["control_hz"] == hz


def test_the_default_system_is_the_policy_in_mujoco():
    assert list_nodes() == list_nodes(system="mujoco_policy")


def test_a_choice_replaces_what_the_system_says():
    nodes = by_name(
        list_nodes(system="mujoco_policy", controller="lqr", backend="mock", task="go_to_position")
    )
    assert nodes["controller"].module == "policy_server.lqr_node"
    assert nodes["plant"].parameters["backend"] == "mock"
    assert nodes["controller"].parameters["task"] == "go_to_position"


def test_a_replaced_choice_takes_the_rate_that_fits_it_and_not_the_file_s():
    assert by_name(list_nodes(system="mujoco_lqr"))["plant"].parameters["control_hz"] == 50.0
    assert (
        by_name(list_nodes(system="mujoco_lqr", controller="policy"))["plant"].parameters["control_hz"] == 5.0
    )
    other_task = by_name(list_nodes(system="mujoco_lqr", task="go_to_position"))
    assert other_task["plant"].parameters["control_hz"] == default_control_hz(
        "floating_platform", "go_to_position", "lqr", "mujoco"
    )


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        ({"system": "mujoco_lqp"}, "Did you mean 'mujoco_lqr'"),
        ({"robot": "floting_platform"}, "Did you mean 'floating_platform'"),
        ({"task": "go_to_pos"}, "Did you mean 'go_to_pos"),
        ({"controller": "lqg"}, "Did you mean 'lqr'"),
        ({"backend": "mujoko"}, "Did you mean 'mujoco'"),
    ],
)
def test_an_unknown_name_gets_the_nearest_one(choice, words):
    with pytest.raises(UnknownNameError, match=words):
        list_nodes(**choice)


def test_hardware_without_a_driver_is_refused():
    with pytest.raises(ConfigError, match="there is no hardware driver for 'floating_platform'"):
        list_nodes(backend="hardware")


def test_the_plant_starts_by_itself_unless_somebody_supervises_it():
    assert plant_spec(PLAN).parameters["autostart"] is True
    assert plant_spec(replace(PLAN, supervised=True)).parameters["autostart"] is False


def test_everything_of_a_plan_reaches_the_nodes():
    plan = replace(
        PLAN, scenario="uncertain", seed=7, start=(1.0, 2.0, 90.0), duration_s=3.0, lockstep=True, rate=2.0
    )
    plant, controller = (
        plant_spec(plan, subscribers=2).parameters,
        controller_spec(plan, subscribers=3).parameters,
    )
    expected = {
        "robot": "floating_platform", "task": "go_to_pose", "backend": "mujoco", "scenario": "uncertain", "seed": 7,
        "start": [1.0, 2.0, 90.0], "control_hz": 50.0, "lockstep": True, "rate": 2.0, "duration_s": 3.0,
        "wait_for_subscribers": 2,
    }  # fmt: skip
    assert plant.items() >= expected.items()
    assert controller.items() >= {"task": "go_to_pose", "lockstep": True, "wait_for_subscribers": 3}.items()


def test_a_bundle_goes_to_the_policy_node_alone():
    with_bundle = replace(PLAN, policy="/some/where")
    assert "policy" not in controller_spec(with_bundle).parameters
    assert controller_spec(replace(with_bundle, controller="policy")).parameters["policy"] == "/some/where"


def test_the_recorder_gets_only_what_was_said():
    assert recorder_spec(PLAN).parameters == {}
    assert recorder_spec(PLAN, directory="d", info="{}").parameters == {
        "directory": "d",
        "run_info": "{}",
    }


def test_a_system_file_with_a_rate_of_nothing_is_refused():
    with pytest.raises(ValueError, match="must be greater than 0"):
        replace(load_system("mujoco_lqr"), control_hz=0.0)
