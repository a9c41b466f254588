"""Goals that come with each step of lock step: none is lost, and a reader that comes late ends with the newest."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest
import rclpy
from geometry_msgs.msg import PoseStamped
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from fulmar_bags.contents import open_bag
from fulmar_core.robots.topics import GOAL_POSE
from fulmar_ros.operator_subscription import subscribe_every
from fulmar_ros.qos import EVERYTHING, publish_patiently, publisher_qos
from fulmar_ros.runtime import spinning
from tests.conftest import RosDomain
from tests.ros.cli import child_running, json_of, start_fulmar, under_way
from tests.ros.neighbour import until
from tests.ros.recorder import ROBOT, Recorder

PLACES = """
kind: positions
title: there and back
positions: [[1.0, 0.0], [0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [1.0, 0.0], [0.0, 0.0]]
"""
HEADER = slice(4, 12)  # the stamp in the CDR bytes of a message that begins with a header


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "goals", "topic", "held_up_s"),
    [
        ("spacecraft_16", "helix", "goal_pose", 0.5),
        ("floating_platform", "places.yaml", "goal_point", 0.5),
        # Longer than the 100 velocities last that its wire keeps by the clock.
        ("turtlebot2", "lab_circle", "goal_velocity", 1.0),
    ],
)
def test_a_recorder_that_is_held_up_has_the_goal_of_each_step(
    robot: str,
    goals: str,
    topic: str,
    held_up_s: float,
    ros_domain: RosDomain,
    tmp_path: Path,
) -> None:
    (tmp_path / "places.yaml").write_text(PLACES, encoding="utf-8")
    asked = ("run", robot, "--goals", goals, "--lockstep", "--record", "bag", "--json")
    run = start_fulmar(*asked, env=ros_domain.env, cwd=tmp_path)
    try:
        assert under_way(run, tmp_path / "bag", 200)
        recorder = child_running(run, "fulmar_ros.recorder_node")
        recorder.send_signal(signal.SIGSTOP)
        time.sleep(held_up_s)
        recorder.send_signal(signal.SIGCONT)
        output, errors = run.communicate(timeout=90.0)
    finally:
        if run.poll() is None:
            run.kill()
    summary = json_of(output)
    assert summary["failure"] is None, errors
    topics = open_bag(tmp_path / "bag").topics
    steps, given = (
        {data[HEADER] for data in topics[f"/{robot}/{name}"].data} for name in ("controller/action", topic)
    )
    assert len(steps) == summary["steps"]
    assert len(steps - given) == 0


def test_a_recorder_that_is_held_up_has_every_goal_that_is_published_patiently(
    record: Callable[..., Recorder], node: Node
) -> None:
    """More than the wire keeps by the clock. That a goal node does so: tests/fulmar_ros/test_goal_node.py."""
    recorder = record("lossless:=true")
    recorder.wait_until_recording()
    publisher = node.create_publisher(PoseStamped, GOAL_POSE.name, publisher_qos(GOAL_POSE, depth=EVERYTHING))
    until(lambda: publisher.get_subscription_count() > 0)
    time.sleep(0.5)  # a publisher knows of a match a moment before the subscriber does
    recorder.process.send_signal(signal.SIGSTOP)
    message = PoseStamped()
    for number in range(300):
        message.header.stamp.sec = number
        publish_patiently(publisher, message)
    recorder.process.send_signal(signal.SIGCONT)
    assert publisher.wait_for_all_acked(Duration(seconds=5.0))
    assert recorder.end(signal.SIGINT)[0] == 0
    given = open_bag(recorder.directory).topics[f"{ROBOT}/{GOAL_POSE.name}"].data
    assert len({data[HEADER] for data in given}) == 300


def test_a_reader_that_comes_late_ends_with_the_newest_goal_and_nobody_waits_for_it(
    ros_domain: RosDomain,
) -> None:
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        sender, late = (rclpy.create_node(name) for name in ("sender", "late"))
        publisher = sender.create_publisher(
            PoseStamped, GOAL_POSE.name, publisher_qos(GOAL_POSE, depth=EVERYTHING)
        )
        message = PoseStamped()
        began = time.monotonic()
        for number in range(6000):  # more than are kept
            message.header.stamp.sec = number
            publish_patiently(publisher, message)
        assert time.monotonic() - began < 4.0
        got: list[int] = []
        subscribe_every(late, PoseStamped, GOAL_POSE, lambda m: got.append(m.header.stamp.sec))
        with spinning(late, lambda error: pytest.fail(repr(error))):
            until(lambda: got[-1:] == [5999])
            assert publisher.wait_for_all_acked(Duration(seconds=5.0))
            assert got == sorted(got)
        sender.destroy_node()
    finally:
        rclpy.try_shutdown()
