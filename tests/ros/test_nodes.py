"""What holds for every node: its parameters and its lifecycle."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from rclpy.lifecycle import TransitionCallbackReturn

from fulmar_core.topics import (
    COMMAND,
    ODOMETRY,
)
from tests.conftest import RosDomain
from tests.ros.neighbour import NAMESPACE, Neighbour, until


@pytest.mark.parametrize(
    ("module", "parameter", "words"),
    [
        ("sim_nodes.sim_node", "robot:='floating_plaform'", "Did you mean 'floating_platform'?"),
        ("sim_nodes.sim_node", "backend:='mujocco'", "Did you mean 'mujoco'?"),
        ("policy_server.policy_node", "policy:='nowhere'", "policy 'nowhere' has no passport.json"),
        ("policy_server.policy_node", "control_hz:=10.0", "was trained at 5 Hz, but would run at 10 Hz"),
        ("hardware_drivers.driver_node", "hardware:='zero_g_lap'", "Did you mean 'zero_g_lab'?"),
        ("hardware_drivers.driver_node", "rate:=2.0", "a real device neither waits nor hurries"),
        (
            "hardware_drivers.adapter_node",
            "hardware:='turtlebot2'",
            "'kobuki' is no message of another stack",
        ),
        ("sim_nodes.emulator_node", "device:='kobuky'", "Did you mean 'kobuki'?"),
        ("policy_server.lqr_node", "rate:=-1.0", "must be a finite number, at least 0"),
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


@pytest.mark.real_time
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
    heard = len(neighbour.applied) if part == "plant" else len(neighbour.commands)
    until(lambda: (len(neighbour.applied) if part == "plant" else len(neighbour.commands)) > heard)
