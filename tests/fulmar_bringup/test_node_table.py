"""The table of processes: pure, and what both launchers start."""

from __future__ import annotations

import inspect
import json
from dataclasses import replace
from importlib.util import find_spec

import pytest

from fulmar_bringup.controller_row import controller_spec
from fulmar_bringup.estimator_row import estimator_specs
from fulmar_bringup.fleet_file import system_names
from fulmar_bringup.launched_system import ARGUMENTS, list_nodes
from fulmar_bringup.node_table import OPTIONS, USUALLY_ON, node_rows, row_of
from fulmar_bringup.plant_row import plant_spec
from fulmar_bringup.recorder_row import recorder_spec
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import Guards, default_control_hz, default_guards, load_system
from fulmar_bringup.system_rows import system_rows
from fulmar_cli.commands.run import run
from fulmar_cli.commands.up import up
from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.config.paths import OWN_FOLDERS

PLAN = RunPlan("floating_platform", "go_to_pose", "lqr", "mujoco", 50.0)
SYSTEMS = pytest.mark.parametrize("system", system_names(fleets=False))


def test_every_controller_node_gets_the_seed_of_the_run_since_one_that_draws_may_take_over():
    plan = replace(PLAN, robot="airship_v7", task="fly_a", seed=3)
    for name in ("mppi", "pid", "lqi"):
        assert controller_spec(replace(plan, controller=name)).parameters["seed"] == 3


def test_a_law_gets_the_trusted_keys_too_since_a_policy_may_take_over():
    plan = replace(PLAN, controller="lqr", guards=Guards(trusted_keys="keys"))
    assert str(controller_spec(plan).parameters["trusted_keys"]).endswith("/keys")


def test_a_plant_is_started_with_what_it_publishes_of_its_system():
    guards = Guards(fallback="lqr", area=(-1.0, 1.0, -2.0, 2.0))
    plan = replace(PLAN, robot="floating_platform", task="go_to_pose", controller="policy", guards=guards)
    parameters = plant_spec(plan).parameters
    assert (parameters["controller"], parameters["fallback"], parameters["bundle"]) == ("policy", "lqr", True)
    assert parameters["area"] == [-1.0, 1.0, -2.0, 2.0]


def by_name(nodes):
    return {node.name: node for node in nodes}


@SYSTEMS
def test_every_system_is_recorder_plant_its_guards_controller_and_markers_in_one_namespace(system):
    nodes, guards = list_nodes(system=system), load_system(system).guards
    asked = [
        name for name, is_asked in (("estop", guards.estop), ("estimator", guards.estimator)) if is_asked
    ]
    assert [node.name for node in nodes] == ["recorder", "plant", *asked, "controller", "markers"]
    assert {node.namespace for node in nodes} == {f"/{load_system(system).robot}"}

    quiet = list_nodes(system=system, markers="false")
    assert [node.name for node in quiet] == [node.name for node in nodes][:-1]


def test_no_node_waits_for_the_one_that_draws():
    rows = [system_rows(replace(PLAN, extras=extras), record={}) for extras in ((), ("markers",))]
    assert set(rows[1]) - set(rows[0]) == {"markers"}
    for name in rows[0]:
        assert rows[0][name].parameters == rows[1][name].parameters


def test_the_node_that_draws_gets_the_area_and_receives_the_goals_of_the_task():
    plan = replace(PLAN, extras=("markers",), guards=Guards(area=(-1.0, 1.0, -2.0, 2.0)))
    markers = system_rows(plan)["markers"]
    assert markers.parameters == {
        "robot": "floating_platform", "task": "go_to_pose", "area": [-1.0, 1.0, -2.0, 2.0],
    }  # fmt: skip
    assert {"goal_pose", "obstacles", "actuators/state"} <= {*markers.observed}
    assert markers.optional


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
    assert nodes["controller"].module == "policy_server.controller_node"
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
    with pytest.raises(ConfigError, match="there is no hardware driver for 'jetbot'"):
        list_nodes(robot="jetbot", controller="classical", backend="hardware")


def test_on_hardware_the_driver_stands_where_the_simulator_stood():
    nodes = by_name(list_nodes(backend="hardware"))
    assert set(nodes) - {"estop", "estimator"} == set(by_name(list_nodes()))
    assert nodes["plant"].module == "hardware_drivers.driver_node"
    assert nodes["plant"].parameters["hardware"].endswith("zero_g_lab.yaml")
    other = by_name(list_nodes(backend="hardware", hardware="zero_g_lab_valve_node"))
    assert other["plant"].parameters["hardware"].endswith("zero_g_lab_valve_node.yaml")


def test_the_plant_starts_by_itself_unless_somebody_supervises_it():
    assert plant_spec(PLAN).parameters["autostart"] is True
    assert plant_spec(replace(PLAN, supervised=True)).parameters["autostart"] is False


def test_everything_of_a_plan_reaches_the_nodes():
    plan = replace(
        PLAN, scenario="uncertain", seed=7, start=(1.0, 2.0, 90.0), duration_s=3.0, lockstep=True, rate=2.0
    )
    rows = system_rows(plan, record={})
    plant, controller = rows["plant"].parameters, rows["controller"].parameters
    expected = {
        "robot": "floating_platform", "task": "go_to_pose", "backend": "mujoco", "scenario": "uncertain", "seed": 7,
        "start": [1.0, 2.0, 90.0], "control_hz": 50.0, "lockstep": True, "rate": 2.0, "duration_s": 3.0,
        "wait_for_subscribers": 2,
    }  # fmt: skip
    assert plant.items() >= expected.items()
    assert controller.items() >= {"task": "go_to_pose", "lockstep": True, "wait_for_subscribers": 2}.items()


def test_a_bundle_goes_to_the_node_that_runs_one_alone():
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


def test_the_guards_of_a_system_reach_the_nodes_that_they_are_for():
    nodes = by_name(list_nodes(system="mujoco_lab"))
    assert nodes["plant"].parameters.items() >= {"estop": True, "estimated": True}.items()
    expected = {"estop": True, "fallback": "lqr", "max_run_time_s": 300.0, "area": [-8.0, 8.0, -8.0, 8.0]}
    assert nodes["controller"].parameters.items() >= expected.items()
    assert nodes["estimator"].parameters["estimator"] == "mocap_imu"
    assert nodes["estop"].parameters == {"robot": "floating_platform"}


def test_a_start_without_a_person_presses_the_e_stop_and_arms_nothing():
    hardware = replace(PLAN, backend="hardware", hardware="zero_g_lab", guards=Guards(estop=True))
    for unattended in (False, True):
        rows = system_rows(replace(hardware, unattended=unattended))
        assert rows["estop"].parameters.get("pressed", False) is unattended
        assert rows["plant"].parameters.get("unattended", False) is unattended
        assert rows["controller"].parameters.get("unattended", False) is unattended


def test_a_system_without_guards_has_none_of_their_parameters():
    nodes = by_name(list_nodes(system="mujoco_lqr"))
    for name in ("estop", "estimated", "fallback", "trusted_keys", "area", "max_run_time_s"):
        assert name not in {**nodes["plant"].parameters, **nodes["controller"].parameters}


@pytest.mark.parametrize(
    ("chosen", "repeats"),
    [
        ({"robot": "turtlebot2", "backend": "hardware"}, True),
        ({"robot": "turtlebot2", "backend": "hardware", "hardware": "turtlebot2_kobuki_node"}, True),
        ({"robot": "turtlebot2", "backend": "mujoco"}, False),
        ({"backend": "hardware"}, False),  # valves, below motion capture
    ],
)
def test_only_odometry_that_a_device_at_rest_repeats_may_repeat(chosen, repeats):
    controller = by_name(list_nodes(controller="classical", **chosen))["controller"]
    assert controller.parameters.get("odometry_may_repeat", False) is repeats


def test_hardware_has_an_e_stop_unless_a_system_file_says_otherwise():
    assert default_guards("policy", "hardware", "turtlebot2").estop
    assert not default_guards("policy", "mujoco").estop


@pytest.mark.parametrize(
    ("hardware", "estimator"),
    [
        ("zero_g_lab", "mocap_imu"),
        ("zero_g_lab_valve_node", "mocap_imu"),
        ("turtlebot2", None),
        ("turtlebot2_kobuki_node", None),
    ],
)
def test_a_robot_that_only_motion_capture_sees_gets_an_estimator(hardware, estimator):
    assert default_guards("policy", "hardware", hardware).estimator == estimator


@pytest.mark.parametrize(
    ("guards", "words"),
    [
        ({"fallback": "lqq"}, "Did you mean 'lqr'"),
        ({"fallback": "policy"}, "not known"),
        ({"trusted_keys": ""}, "'trusted_keys' is empty"),
        ({"trusted_keys": " "}, "'trusted_keys' is empty"),
        ({"max_run_time_s": -1.0}, "max_run_time_s"),
        ({"area": (1.0, 0.0, 0.0, 1.0)}, "x_min < x_max"),
    ],
)
def test_guards_without_meaning_are_refused(guards, words):
    with pytest.raises(ValueError, match=words):
        Guards(**guards)


def test_on_hardware_whoever_sees_a_thing_publishes_it_and_of_an_emulated_device_nobody_does(tmp_path):
    plan = replace(PLAN, robot="turtlebot2", task="push_block", backend="hardware", hardware="turtlebot2")
    rows = system_rows(plan)
    assert "block/pose" in rows["controller"].inputs
    assert "block/pose" not in rows["plant"].outputs
    with pytest.raises(ConfigError, match="receives 'block/pose', which nothing in the system publishes"):
        system_rows(replace(plan, emulated=True), wires_folder=tmp_path)


def test_a_recorder_is_reported_the_things_of_the_task():
    push = replace(PLAN, robot="turtlebot2", task="push_block")
    assert recorder_spec(push).parameters["things"] == ["block"]
    assert "things" not in recorder_spec(PLAN).parameters


def test_an_emulated_device_is_a_row_of_the_launch_file_too():
    rows = by_name(list_nodes(robot="turtlebot2", task="go_to_position", controller="classical", backend="hardware",
                              emulate="true"))  # fmt: skip
    assert rows["plant"].parameters["port"] == rows["emulator"].parameters["link"]
    with pytest.raises(ConfigError, match="not with mujoco"):
        list_nodes(emulate="true")


def test_a_system_file_names_nodes_of_its_own(tmp_path, monkeypatch):
    (tmp_path / "systems").mkdir()
    (tmp_path / "systems" / "seeing.yaml").write_text(
        "title: with a camera\nrobot: floating_platform\ntask: go_to_pose\ncontroller: lqr\nbackend: mock\n"
        "control_hz: 50.0\nnodes:\n"
        "  - {name: camera, module: mine.camera_node, inputs: [odom], outputs: [image], parameters: {rate_hz: 5.0}}\n"
    )
    monkeypatch.setenv(OWN_FOLDERS, str(tmp_path))
    row = by_name(list_nodes(system="seeing"))["camera"]
    assert (row.module, row.executable, row.namespace) == (
        "mine.camera_node",
        "camera_node",
        "/floating_platform",
    )
    assert (row.inputs, row.parameters) == (("odom",), {"rate_hz": 5.0})


def test_a_launched_system_takes_a_name_from_its_file_and_from_its_argument(tmp_path, monkeypatch):
    (tmp_path / "systems").mkdir()
    text = "title: t\nrobot: floating_platform\ntask: go_to_pose\ncontroller: lqr\nbackend: mock\ncontrol_hz: 50.0\n"
    more = "name: alpha\nnodes:\n  - {name: camera, module: mine.camera_node, inputs: [odom]}\n"
    (tmp_path / "systems" / "seeing.yaml").write_text(text + more)
    (tmp_path / "systems" / "wrong.yaml").write_text(text + "name: Alpha-1\n")
    monkeypatch.setenv(OWN_FOLDERS, str(tmp_path))
    assert {row.namespace for row in list_nodes(system="seeing")} == {"/alpha"}
    rows = list_nodes(system="seeing", name="beta")
    assert {row.namespace for row in rows} == {"/beta"}
    info = json.loads(by_name(rows)["recorder"].parameters["run_info"])
    assert (info["robot"], info["name"]) == ("floating_platform", "beta")
    with pytest.raises(
        ConfigError, match=r"wrong.yaml:1: .* 'Alpha-1' of a robot must begin with a small letter"
    ):
        list_nodes(system="wrong")
    with pytest.raises(ConfigError, match="'4b' of a robot must"):
        list_nodes(system="seeing", name="4b")


@pytest.mark.parametrize(
    ("changes", "repeats"),
    [
        ({}, False),
        ({"scenario": "ideal"}, True),
        ({"backend": "mock"}, True),
    ],
)
def test_measurements_without_noise_may_repeat_while_a_robot_stands(changes, repeats):
    parameters = controller_spec(replace(PLAN, **changes)).parameters
    assert parameters.get("odometry_may_repeat", False) is repeats
    estimating = replace(PLAN, guards=Guards(estimator="mocap_imu"), **changes)
    assert estimator_specs(estimating)[0].parameters.get("exact_sensors", False) is repeats


@pytest.mark.parametrize("name", OPTIONS)
def test_an_optional_node_is_a_row_an_option_of_two_commands_and_a_launch_argument(name):
    for command, runs in ((run, False), (up, name in USUALLY_ON)):
        assert inspect.signature(command).parameters[name].default is runs
    assert name in ARGUMENTS
    assert name not in system_rows(PLAN)
    assert name in system_rows(replace(PLAN, extras=(name,)))


def test_every_node_has_one_row():
    names = [name for row in node_rows() for name in row.names]
    assert len(names) == len(set(names))
    assert all(row_of(name).names for name in names)
