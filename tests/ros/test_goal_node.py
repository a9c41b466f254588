"""The goal node on the wires, and in a loop with a plant and a controller; see tests/fulmar_ros/test_goal_node.py."""

from __future__ import annotations

import contextlib
import math
import signal
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import PointStamped, PoseStamped

from fulmar_bags.message_reader import stamp_ns
from fulmar_core.robots.topics import GOAL_POSE, GOAL_WIRES, RELAY
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks.goal_files import GoalFile, single_goal
from fulmar_ros.goal_node import GoalNode
from fulmar_ros.operator_subscription import LOOK_S
from fulmar_ros.qos import subscriber_qos
from fulmar_ros.relay import Relay
from fulmar_ros.runtime import spinning
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, start_fulmar
from tests.ros.neighbour import NAMESPACE, Neighbour, Stream, until

pytestmark = pytest.mark.real_time

POSITIONS = """
kind: positions
title: here, then there
positions: [[1.0, 0.0], [1.0, 1.0]]
"""
PATIENT = {"input_timeout_s": 5.0}  # a busy machine may hold up the odometry


@contextlib.contextmanager
def goal_node(place: GoalFile | None = None, **parameters: object) -> Iterator[list[int]]:
    """A goal node for a file, or for one place as the command line gives it; the codes with which it asks to end."""
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}"]
    for name, value in {**PATIENT, **parameters}.items():
        arguments += ["-p", f"{name}:={value}"]
    codes: list[int] = []
    node = GoalNode(codes.append, goals=place, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        yield codes
        node.stop()


def test_a_volatile_subscriber_that_comes_late_gets_the_goal_with_its_stamp_and_disturbs_no_latched_one(
    tmp_path, neighbour: Neighbour
) -> None:
    (tmp_path / "mine.yaml").write_text(POSITIONS)
    points: list[PointStamped] = []
    qos = subscriber_qos(GOAL_WIRES["goal_point"], depth=50)
    neighbour.node.create_subscription(PointStamped, "goal_point", points.append, qos)
    odometry = Stream(neighbour)
    with goal_node(goals=tmp_path / "mine.yaml", stay=True):
        until(lambda: len(points) == 1)
        late = rclpy.create_node("stranger", namespace=NAMESPACE)
        got: list[PointStamped] = []
        late.create_subscription(PointStamped, "goal_point", got.append, 10)
        with spinning(late, lambda error: pytest.fail(repr(error))):
            until(lambda: bool(got))
        assert got[0] == points[0]
        until(lambda: points[1:] == got)  # what the others receive is the very same message
        time.sleep(2.0 * LOOK_S)
        assert len(points) == 2  # once for each that comes
    odometry.stop()


@pytest.mark.slow  # the node itself ends by a clock of the test in tests/fulmar_ros
def test_goals_for_a_robot_that_is_not_up_end_with_one_line(tmp_path, ros_domain: RosDomain) -> None:
    words = ("goals", "lab_pose", "--robot", "floating_platform")
    done = fulmar(*words, env=ros_domain.env, cwd=tmp_path, timeout_s=30.0)
    assert done.returncode == 1
    (line,) = [line for line in done.stderr.splitlines() if "ERROR" in line]
    assert "nothing comes on /floating_platform/odom (after 5 s)" in line
    assert "--wait" in line
    assert "WARN" not in done.stderr


def test_a_pose_on_the_command_line_becomes_the_goal_of_a_running_controller(
    tmp_path, neighbour: Neighbour, stream: Stream, controller: Any, ros_domain: RosDomain
) -> None:
    """And of whoever subscribes as a node does by default, with a stamp."""
    got: list[PoseStamped] = []
    neighbour.node.create_subscription(PoseStamped, "goal_pose", got.append, 10)
    words = ("goals", "--robot", "floating_platform", "--pose", "3,1,90")
    command = start_fulmar(*words, env=ros_domain.env, cwd=tmp_path)
    try:
        until(lambda: bool(np.allclose(controller.guard.loop.goal.current, [3.0, 1.0, math.pi / 2])), 20.0)
        until(
            lambda: any(stamp_ns(message.header.stamp) and message.pose.position.y == 1.0 for message in got)
        )
        command.send_signal(signal.SIGINT)
        _, said = command.communicate(timeout=20.0)
    finally:
        if command.poll() is None:
            command.kill()
    assert command.returncode == 0, said
    (line,) = [line for line in said.splitlines() if "published" in line]
    assert "x 3, y 1 m, heading 90 degrees on /floating_platform/goal_pose" in line


def test_a_goal_that_only_another_node_received_is_followed(
    neighbour: Neighbour, stream: Stream, controller: Any
) -> None:
    relay, goal = Relay(neighbour.node), PoseStamped()
    goal.header.frame_id, goal.pose.position.x, goal.pose.orientation.w = "odom", 2.0, 1.0
    now_ns = time.time_ns()
    info = {"source_timestamp": now_ns, "publication_sequence_number": 1, "received_timestamp": now_ns}
    until(lambda: neighbour.node.count_subscribers(f"{NAMESPACE}/{RELAY.name}") > 0)
    time.sleep(0.3)
    relay.send(GOAL_POSE, goal, info)
    until(lambda: bool(np.allclose(controller.guard.loop.goal.current, [2.0, 0.0, 0.0])))


def test_a_pose_beyond_the_geofence_of_the_running_controller_ends_with_one_line(
    neighbour: Neighbour, stream: Stream, controller: Any, capfd
) -> None:
    with goal_node(single_goal((100.0, 3.0, 90.0), PlanarState)) as codes:
        until(lambda: codes == [1])
    said = capfd.readouterr().err
    (line,) = [line for line in said.splitlines() if "ERROR" in line]
    assert "the controller refuses the goal: goal is 100.0 m away, beyond the geofence of 8 m" in line
    assert "goal refused: goal is 100.0 m away, beyond the geofence of 8 m" in said


@pytest.mark.slow
@pytest.mark.parametrize("controller", [["odometry_may_repeat:=true"]], indirect=True)  # a mock has no noise
def test_a_simulated_platform_goes_where_the_command_states_it(
    tmp_path, neighbour: Neighbour, plant: Any, controller: Any, ros_domain: RosDomain
) -> None:
    """`fulmar goals` in a process of its own, with a plant and an LQR that go to poses."""
    neighbour.withdraw_command()  # of each wire only one node may publish
    neighbour.withdraw_odometry()
    neighbour.node.destroy_publisher(neighbour.bearing)
    (tmp_path / "near.yaml").write_text("kind: poses\ntitle: near\nposes: [[0.3, 0.0, 0.0]]\n")
    command = start_fulmar(
        "goals", "near.yaml", "--robot", "floating_platform", env=ros_domain.env, cwd=tmp_path
    )
    try:
        _, words = command.communicate(timeout=60.0)
    finally:
        if command.poll() is None:
            command.kill()
    assert command.returncode == 0, words
    assert "1 of 1 targets reached" in words
