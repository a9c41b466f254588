"""The controller node against hand-made odometry: refuses what it must, and says so."""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Callable

import numpy as np
import pytest
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState

from fulmar_core.controllers.lqr import Lqr
from fulmar_core.goal import goal_at
from fulmar_core.robot import Robot
from fulmar_core.tasks.go_to_pose import GoToPose
from fulmar_core.topics import (
    COMMAND,
    ESTOP,
    GOAL_POSE,
    IMU,
    ODOMETRY,
    STATUS,
    SWAP,
    TRUTH,
)
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.controller_settings import ControllerSettings
from fulmar_ros.goal_messages import goal_message
from fulmar_ros.message_reader import stamp_ns
from fulmar_ros.qos import subscriber_qos
from fulmar_ros.runtime import spinning
from policy_server.lqr_node import make_lqr
from tests.conftest import RosDomain
from tests.ros.neighbour import NAMESPACE, Neighbour, Stream, until

pytestmark = pytest.mark.real_time


def spoil_value(message: Odometry) -> None:
    message.pose.pose.position.x = float("nan")


def spoil_frame(message: Odometry) -> None:
    message.header.frame_id = "map"


def spoil_quaternion(message: Odometry) -> None:
    message.pose.pose.orientation.w = 2.0


def spoil_speed(message: Odometry) -> None:
    message.twist.twist.linear.x = 50.0


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (spoil_value, "not finite"),
        (spoil_frame, "must be 'odom'"),
        (spoil_quaternion, "norm"),
        (spoil_speed, "beyond the possible"),
    ],
)
def test_unbelievable_odometry_gets_closed_valves_and_a_reason(
    spoil: Callable[[Odometry], None], reason: str, stream: Stream
) -> None:
    """Each fault alone, after a good start."""
    stream.spoil = spoil
    until(lambda: reason in stream.neighbour.said["controller"][1]["reason"])
    until(lambda: not stream.neighbour.commands[-1].any())


def test_a_frozen_sensor_is_noticed(stream: Stream) -> None:
    """Stamps go on, the pose does not move by a micrometre."""
    stream.moving = False
    until(lambda: "stuck" in stream.neighbour.said["controller"][1]["reason"])
    until(lambda: not stream.neighbour.commands[-1].any())


def test_a_stamp_that_goes_back_is_refused(stream: Stream) -> None:
    """Reordered or replayed measurements do not move the robot."""
    stream.step_ns = -20_000_000
    until(lambda: "went back" in stream.neighbour.said["controller"][1]["reason"])
    until(lambda: not stream.neighbour.commands[-1].any())


def test_silence_of_the_odometry_closes_the_valves(stream: Stream) -> None:
    """At 50 Hz within 0.2 s and a period."""
    stream.stop()
    since = time.monotonic()
    until(lambda: not stream.neighbour.commands[-1].any())
    assert time.monotonic() - since < 0.4
    until(lambda: "no usable odom" in stream.neighbour.said["controller"][1]["reason"])


def test_a_controller_hears_odometry_and_its_goal_and_never_the_truth(
    neighbour: Neighbour, controller: ControllerNode
) -> None:
    """What a deployed controller may know."""
    heard = {subscription.topic_name for subscription in controller.subscriptions}
    assert heard == {f"{NAMESPACE}/{wire.name}" for wire in (ODOMETRY, GOAL_POSE, ESTOP, SWAP)}
    assert f"{NAMESPACE}/{TRUTH.name}" not in heard
    assert {STATUS.name, IMU.name}.isdisjoint(heard)


def test_a_controller_that_raises_commands_what_is_safe_and_ends(
    neighbour: Neighbour, ros_domain: RosDomain
) -> None:
    """The robot does not wait for the watchdog."""

    class Raising(Lqr):
        def act(self, observation: np.ndarray) -> np.ndarray:
            if np.any(observation):
                raise ZeroDivisionError("no gain today")
            return super().act(observation)

    def make(robot: Robot, task: GoToPose, settings: ControllerSettings) -> Lqr:
        good = make_lqr(robot, task, settings)
        good.__class__ = Raising
        return good

    codes: list[int] = []
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "control_hz:=50.0"]
    node = ControllerNode(make, codes.append, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        neighbour.give_goal()
        odometry = Stream(neighbour)
        until(lambda: codes != [])
        odometry.stop()
        assert set(codes) == {1}
        until(lambda: "no gain today" in neighbour.said["controller"][1]["reason"])
        assert not any(command.any() for command in neighbour.commands)
        node.stop()


def test_a_goal_beyond_the_geofence_opens_no_valve(stream: Stream) -> None:
    """Judged at once, not at the next measurement."""
    neighbour = stream.neighbour
    neighbour.goal_publisher.publish(goal_message(goal_at((300.0, 0.0, 0.0)), "goal_pose", 2))
    until(lambda: "geofence" in neighbour.said["controller"][1]["reason"])
    until(lambda: not neighbour.commands[-1].any())


def test_deactivation_ends_with_the_safe_command(stream: Stream, controller: ControllerNode) -> None:
    """Then silence."""
    controller.trigger_deactivate()
    until(lambda: not stream.neighbour.commands[-1].any())
    count = len(stream.neighbour.commands)
    time.sleep(0.2)
    assert len(stream.neighbour.commands) == count


def test_copies_of_a_command_come_within_its_period(neighbour: Neighbour, monkeypatch) -> None:
    """Three of each, all with the stamp of the state that it answers."""
    monkeypatch.setattr(sys, "argv", ["lqr_node"])
    stamps: list[int] = []
    qos = subscriber_qos(COMMAND, reliable=True, depth=50)
    neighbour.node.create_subscription(
        JointState, COMMAND.name, lambda message: stamps.append(stamp_ns(message.header.stamp)), qos
    )
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "control_hz:=10.0", "-p", "copies:=3"]
    node = ControllerNode(make_lqr, lambda _code: None, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        neighbour.give_goal()
        odometry = Stream(neighbour)
        until(lambda: bool(neighbour.commands) and neighbour.commands[-1].any())
        stamps.clear()
        until(lambda: len(stamps) > 20)
        odometry.stop()
        node.stop()
    whole = [len(list(same)) for _, same in itertools.groupby(stamps)][1:-1]
    assert np.median(whole) == 3


def test_more_copies_than_fit_into_a_period_are_refused() -> None:
    with pytest.raises(ValueError, match="copies = 4 must be from 1 to 3"):
        ControllerSettings(copies=4)
