"""What holds for every node: its parameters and its lifecycle."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path

import pytest
import rclpy
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.node import Node

from fulmar_bringup.emulation import emulation_of
from fulmar_bringup.emulator_row import emulator_spec
from fulmar_bringup.goals_row import goals_spec, run_goals_spec
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import Guards
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import ConfigError
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.robots.topics import (
    COMMAND,
    ODOMETRY,
)
from fulmar_ros.estimator_node import EstimatorNodeSettings
from fulmar_ros.estop_node import EstopSettings
from fulmar_ros.goal_node import GoalSettings
from fulmar_ros.parameters import read_parameters
from fulmar_ros.plant_settings import PlantSettings
from fulmar_ros.recorder_settings import RecorderSettings
from hardware_drivers.driver_node import DriverSettings
from hardware_drivers.hardware import load_hardware
from sim_nodes.emulator_node import EmulatorSettings
from tests.conftest import RosDomain
from tests.ros.neighbour import NAMESPACE, Neighbour, until


@pytest.mark.parametrize(
    ("module", "parameter", "words"),
    [
        ("sim_nodes.sim_node", "robot:='floating_plaform'", "Did you mean 'floating_platform'?"),
        ("policy_server.controller_node", "control_hz:=10.0", "was trained at 5 Hz, but would run at 10 Hz"),
        *(
            pytest.param(*case, marks=pytest.mark.slow)
            for case in (
                (
                    "policy_server.controller_node",
                    "policy:='nowhere'",
                    "policy 'nowhere': the folder does not exist",
                ),
                ("policy_server.controller_node", "rate:=-1.0", "must be a finite number, at least 0"),
                ("hardware_drivers.driver_node", "hardware:='zero_g_lap'", "Did you mean 'zero_g_lab'?"),
                ("hardware_drivers.driver_node", "rate:=2.0", "a real device runs in real time"),
                (
                    "hardware_drivers.adapter_node",
                    "hardware:='turtlebot2'",
                    "'kobuki' is no message of another stack",
                ),
                ("sim_nodes.emulator_node", "device:='kobuky'", "Did you mean 'kobuki'?"),
            )
        ),
    ],
)
def test_a_wrong_parameter_ends_a_node_with_one_line_and_exit_code_two(
    module: str, parameter: str, words: str, ros_domain: RosDomain, tmp_path: Path
) -> None:
    """Fail closed, before anything moves."""
    done = subprocess.run(
        [sys.executable, "-m", module, "--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", parameter],
        env=ros_domain.env,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=30.0,
        check=False,
    )
    assert done.returncode == 2, done.stderr
    assert words in done.stderr
    assert "Traceback" not in done.stderr


SETTINGS = {
    "sim_nodes.sim_node": PlantSettings,
    "sim_nodes.emulator_node": EmulatorSettings,
    "hardware_drivers.driver_node": DriverSettings,
    "fulmar_ros.recorder_node": RecorderSettings,
    "fulmar_ros.estop_node": EstopSettings,
    "fulmar_ros.estimator_node": EstimatorNodeSettings,
    "fulmar_ros.goal_node": GoalSettings,
}  # of all other nodes: those of a controller


def test_the_node_table_sends_no_parameter_that_its_node_does_not_have() -> None:
    guards = Guards(
        estop=True, estimator="mocap_imu", fallback="lqr", max_run_time_s=1.0, area=(0.0, 1.0, 0.0, 1.0)
    )
    base = RunPlan(
        "floating_platform", "go_to_pose", "policy", "mujoco", control_hz=5.0, policy="p", guards=guards
    )
    hardware = replace(
        base, backend="hardware", hardware="zero_g_lab", goals="lab_pose", copies=2, guards=Guards()
    )
    specs = [goals_spec("floating_platform", "lab_pose", give_up_s=5.0), run_goals_spec(hardware)]
    for plan in (base, hardware):
        specs += system_rows(plan, record={}, port="x").values()
    specs.append(emulator_spec(hardware, emulation_of(load_hardware("zero_g_lab"), Path("scratch"))))
    for spec in specs:
        known = {field.name for field in fields(SETTINGS.get(spec.module, ControllerSettings))}
        assert set(spec.parameters) <= known, spec.module


def test_parameters_of_rclpy_itself_are_known_to_every_node(ros_domain: RosDomain) -> None:
    own = (
        "use_sim_time:=true",
        "start_type_description_service:=false",
        "qos_overrides./odom.publisher.depth:=1",
    )
    arguments = [word for parameter in (*own, "rate:=2.0") for word in ("-p", parameter)]
    context = rclpy.Context()
    rclpy.init(args=[], context=context)
    try:
        node = Node("goals", context=context, cli_args=["--ros-args", *arguments])
        assert read_parameters(node, GoalSettings).rate == 2.0
        node.destroy_node()
        other = Node("goals", context=context, cli_args=["--ros-args", "-p", "rates:=2.0"])
        with pytest.raises(ConfigError, match=r"'rates' of node 'goals' is not known. Did you mean 'rate'\?"):
            read_parameters(other, GoalSettings)
        other.destroy_node()
    finally:
        rclpy.shutdown(context=context)


@pytest.mark.parametrize("part", ["plant", "controller"])
def test_a_node_survives_its_whole_lifecycle_twice(
    part: str, request: pytest.FixtureRequest, neighbour: Neighbour
) -> None:
    """Clean up leaves nothing behind, and a second configuration works like the first."""
    node = request.getfixturevalue(part)
    for transition in ("deactivate", "cleanup"):
        assert getattr(node, f"trigger_{transition}")() == TransitionCallbackReturn.SUCCESS
    topics = {COMMAND.name, ODOMETRY.name}
    ours = [
        publisher.topic_name for publisher in node.publishers if publisher.topic_name.endswith(tuple(topics))
    ]
    assert not ours
    for transition in ("configure", "activate"):
        assert getattr(node, f"trigger_{transition}")() == TransitionCallbackReturn.SUCCESS
    received = len(neighbour.applied) if part == "plant" else len(neighbour.commands)
    until(lambda: (len(neighbour.applied) if part == "plant" else len(neighbour.commands)) > received)
