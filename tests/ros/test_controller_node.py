"""The controller node against hand-made odometry: refuses what it must, and says so."""

from __future__ import annotations

import itertools
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from nav_msgs.msg import Odometry
from rclpy.lifecycle import TransitionCallbackReturn
from sensor_msgs.msg import JointState

from fulmar_bags.message_reader import stamp_ns
from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.lqr import Lqr
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import (
    ACTUATORS_STATE,
    AIR_BEARING,
    COMMAND,
    ESTOP,
    ESTOP_RELEASED,
    GOAL_POSE,
    IMU,
    ODOMETRY,
    OPERATOR_ACTION,
    RELAY,
    STATUS,
    SWAP,
    TRUTH,
)
from fulmar_core.tasks.go_to_pose import GoToPose
from fulmar_ros import deadline
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.qos import subscriber_qos
from fulmar_ros.runtime import spinning
from tests.conftest import RosDomain
from tests.ros.controllers import make_lqr
from tests.ros.neighbour import NAMESPACE, Neighbour, Stream, asked_by_neighbour, until

real_time = pytest.mark.real_time


def lqr_that(**changes: Callable) -> Callable[[Robot, GoToPose, ControllerSettings], Lqr]:
    """The LQR with some of its methods replaced."""

    def make(robot: Robot, task: GoToPose, settings: ControllerSettings) -> Lqr:
        good = make_lqr(robot, task, settings)
        good.__class__ = type("Changed", (Lqr,), changes)
        return good

    return make


@contextmanager
def running(make: Callable, codes: list[int], *parameters: str) -> Iterator[ControllerNode]:
    """A controller node at 50 Hz, stopped at the end."""
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "control_hz:=50.0"]
    for parameter in parameters:
        arguments += ["-p", parameter]
    node = ControllerNode(make, codes.append, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        yield node
        node.stop()


@contextmanager
def measured(neighbour: Neighbour) -> Iterator[Stream]:
    """Odometry for as long as the context lasts."""
    odometry = Stream(neighbour)
    try:
        yield odometry
    finally:
        odometry.stop()


def reported(neighbour: Neighbour, key: str) -> str:
    """A value of the controller's status; empty before the first."""
    return neighbour.said.get("controller", ("", {}))[1].get(key, "")


def spoil_frame(message: Odometry) -> None:
    message.header.frame_id = "map"


@real_time
def test_unbelievable_odometry_gets_closed_valves_and_a_reason(stream: Stream) -> None:
    """After a good start."""
    stream.spoil = spoil_frame
    until(lambda: "must be 'odom'" in reported(stream.neighbour, "reason"))
    until(lambda: not stream.neighbour.commands[-1].any())


@real_time
def test_silence_of_the_odometry_closes_the_valves(stream: Stream) -> None:
    """At 50 Hz within 0.2 s and a period."""
    stream.stop()
    since = time.monotonic()
    until(lambda: not stream.neighbour.commands[-1].any())
    assert time.monotonic() - since < 0.4
    until(lambda: "no usable odom" in reported(stream.neighbour, "reason"))


def test_a_controller_receives_odometry_and_its_goal_and_never_the_truth(
    neighbour: Neighbour, controller: ControllerNode
) -> None:
    """What a deployed controller may know; of a robot with thrusters on an air bearing, what these do as well."""
    received = {subscription.topic_name for subscription in controller.subscriptions}
    wires = (
        *(ODOMETRY, GOAL_POSE, ESTOP, ESTOP_RELEASED, SWAP, ACTUATORS_STATE, AIR_BEARING, RELAY),
        OPERATOR_ACTION,
    )
    assert received == {f"{NAMESPACE}/{wire.name}" for wire in wires}
    assert f"{NAMESPACE}/{TRUTH.name}" not in received
    assert {STATUS.name, IMU.name}.isdisjoint(received)


@real_time
def test_a_controller_that_raises_commands_what_is_safe_and_ends(
    neighbour: Neighbour, ros_domain: RosDomain
) -> None:
    """The robot does not wait for the watchdog."""

    def act(self: Lqr, inputs: Inputs) -> np.ndarray:
        if asked_by_neighbour(inputs):
            raise ZeroDivisionError("no gain today")
        return Lqr.act(self, inputs)

    codes: list[int] = []
    with running(lqr_that(act=act), codes), measured(neighbour):
        neighbour.give_goal()
        until(lambda: codes != [])
        until(lambda: "no gain today" in reported(neighbour, "reason"))
        assert set(codes) == {1}
        assert not any(command.any() for command in neighbour.commands)


@real_time
def test_beats_that_all_come_late_are_a_fault(neighbour: Neighbour) -> None:
    def act(self: Lqr, inputs: Inputs) -> np.ndarray:
        time.sleep(0.05 if asked_by_neighbour(inputs) else 0.0)
        return Lqr.act(self, inputs)

    with running(lqr_that(act=act), [], "overruns_to_stop:=5"), measured(neighbour):
        neighbour.give_goal()
        until(lambda: "5 beats in a row came late" in reported(neighbour, "reason"))
        assert reported(neighbour, "mode") == "fault"
        until(lambda: not neighbour.commands[-1].any())


@real_time
def test_deactivation_ends_with_the_safe_command(stream: Stream, controller: ControllerNode) -> None:
    """Then silence."""
    controller.trigger_deactivate()
    until(lambda: not stream.neighbour.commands[-1].any())
    time.sleep(0.3)  # for its repetitions
    count = len(stream.neighbour.commands)
    time.sleep(0.2)
    assert len(stream.neighbour.commands) == count


@real_time
def test_shutdown_from_active_ends_with_the_safe_command(stream: Stream, controller: ControllerNode) -> None:
    controller.executor.create_task(controller.trigger_shutdown)  # as a service does: between two callbacks
    until(lambda: not stream.neighbour.commands[-1].any())


@real_time
def test_copies_of_a_command_come_within_its_period(neighbour: Neighbour, monkeypatch) -> None:
    """Three of each, all with the stamp of the state that it answers."""
    monkeypatch.setattr(sys, "argv", ["controller_node"])
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


@real_time
def test_a_control_loop_that_fails_outside_the_controller_is_a_fault_and_ends_the_process(
    neighbour: Neighbour, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A thread that just ended would leave a node that looks as if it waited."""
    codes: list[int] = []
    with running(make_lqr, codes) as node, measured(neighbour):
        neighbour.give_goal()
        until(lambda: bool(neighbour.commands) and neighbour.commands[-1].any())

        def lost(*_: object) -> None:
            raise OSError("the middleware is gone")

        monkeypatch.setattr(node.wires, "publish_reasoning", lost)
        until(lambda: codes == [1])
        until(lambda: "the middleware is gone" in reported(neighbour, "reason"))
        assert reported(neighbour, "mode") == "fault"


@real_time
@pytest.mark.parametrize("fallback", [False, True])
def test_a_controller_that_raises_when_it_begins_anew_is_given_up(
    fallback: bool, neighbour: Neighbour
) -> None:
    resets: list[int] = []

    def reset(_self: Lqr) -> None:
        resets.append(1)
        if len(resets) > 1:  # the first is part of the warm-up
            raise OSError("no memory")

    codes: list[int] = []
    parameters = ["fallback:=lqr"] if fallback else []
    with running(lqr_that(reset=reset), codes, *parameters), measured(neighbour):
        neighbour.give_goal()
        if fallback:
            until(lambda: "no memory" in reported(neighbour, "fell_back"))
            until(lambda: neighbour.commands[-1].any())
            assert codes == []
        else:
            until(lambda: "no memory" in reported(neighbour, "reason"))
            assert set(codes) == {1}


@real_time
def test_what_a_controller_that_hung_comes_up_with_does_not_follow_the_safe_command(
    neighbour: Neighbour, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(deadline, "PATIENCE_S", 0.2)
    hangs, release, over = threading.Event(), threading.Event(), threading.Event()

    def act(self: Lqr, inputs: Inputs) -> np.ndarray:
        command = Lqr.act(self, inputs)
        if hangs.is_set():
            release.wait()
            over.set()
        return command

    with running(lqr_that(act=act), []) as node, measured(neighbour):
        neighbour.give_goal()
        until(lambda: bool(neighbour.commands) and neighbour.commands[-1].any())
        hangs.set()
        time.sleep(0.1)
        node.trigger_deactivate()
        until(lambda: not neighbour.commands[-1].any())
        assert node.trigger_activate() != TransitionCallbackReturn.SUCCESS
        release.set()
        until(over.is_set)
        time.sleep(0.2)
        assert not neighbour.commands[-1].any()


@real_time
def test_a_goal_that_comes_while_the_controller_acts_does_not_take_its_memory_away_meanwhile(
    neighbour: Neighbour,
) -> None:
    acting = threading.Event()

    def act(self: Lqr, inputs: Inputs) -> np.ndarray:
        acting.set()
        time.sleep(0.01)
        acting.clear()
        return Lqr.act(self, inputs)

    def reset(self: Lqr) -> None:
        resets.append(acting.is_set())
        Lqr.reset(self)

    resets: list[bool] = []
    with running(lqr_that(act=act, reset=reset), []), measured(neighbour):
        neighbour.give_goal()
        until(lambda: bool(neighbour.commands) and neighbour.commands[-1].any())
        begun = len(resets)
        for _ in range(30):
            neighbour.give_goal()
            time.sleep(0.013)
        assert len(resets) > begun + 10
        assert not any(resets)
