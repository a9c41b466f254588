"""The controller's node without a clock and without neighbours: what it answers, and when it must not."""

from __future__ import annotations

import time

import pytest
from geometry_msgs.msg import PoseStamped
from rclpy.lifecycle import TransitionCallbackReturn
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, String
from visualization_msgs.msg import MarkerArray

from fulmar_core.config.errors import BundleError, FulmarError
from fulmar_core.controllers.lqr import Lqr
from fulmar_core.safety.arbiter import Mode
from fulmar_ros.controller_node import ControllerNode
from tests.fulmar_ros.by_hand import DrivenController, arguments, ros
from tests.ros.controllers import make_lqr

ROUND = 1_000_000_000


@pytest.fixture(autouse=True)
def context(ros_domain):
    with ros():
        yield


def started(make=make_lqr, *parameters: str) -> DrivenController:
    """One that has a goal and has answered once."""
    driven = DrivenController(make, *parameters)
    driven.give()
    assert driven.see().any()
    return driven


def lqr_that_raises_at(number: int):
    """The LQR, which raises at the step of a number after its warm-up."""
    steps = iter(range(-20, 1000))

    def act(self, inputs):
        if next(steps) == number:
            raise ZeroDivisionError("by nothing")
        return Lqr.act(self, inputs)

    def make(robot, task, settings):
        law = make_lqr(robot, task, settings)
        law.__class__ = type("Raising", (Lqr,), {"act": act})
        return law

    return make


def test_a_controller_that_raises_is_answered_by_the_safe_command_and_a_fault():
    driven = started(lqr_that_raises_at(1))
    assert not driven.see().any()
    assert driven.node.guard.flags.latched_fault == "the controller raised ZeroDivisionError: by nothing"
    assert driven.codes == [1]
    assert not driven.see().any()


def test_after_its_deactivation_a_step_that_was_under_way_sends_nothing():
    driven = started()
    driven.node.guard.set(activated=False)
    measurement = driven.node.guard.newest
    before = len(driven.sent)
    driven.node._send(lambda: driven.sent.append(measurement))
    assert len(driven.sent) == before


def test_the_last_words_of_a_controller_are_the_safe_command():
    driven = started()
    before = len(driven.sent)
    driven.node.stop()
    last = driven.sent[before:]
    assert len(last) > 1 and not any(command.any() for command in last)


def test_odometry_of_two_nodes_is_answered_by_the_safe_command(monkeypatch):
    driven = started()
    monkeypatch.setattr(driven.node._writer_watch, "look", lambda _now_ns: "2 nodes publish odom: /a, /b")
    assert not driven.see().any()
    monkeypatch.setattr(driven.node._writer_watch, "look", lambda _now_ns: "")
    assert driven.see().any()


@pytest.mark.parametrize("data", [b"", b"\x00\x01", b"\xff" * 700])
def test_torn_odometry_is_no_odometry(data):
    driven = started()
    newest = driven.node.guard.newest
    assert driven.see(data) is None
    assert driven.node.guard.newest is newest


def test_beats_that_come_late_in_a_row_are_a_fault():
    driven = started(make_lqr, "overruns_to_stop:=3")
    driven.node._beat.deadlines.late_in_a_row = 2
    driven.node._step()
    assert driven.sent[-1].any()
    driven.node._beat.deadlines.late_in_a_row = 3
    driven.node._step()
    assert not driven.sent[-1].any()
    assert driven.node.guard.decide(ROUND).mode is Mode.FAULT


def test_a_controller_that_is_refused_is_not_configured():
    def refuse(_robot, _task, _settings):
        raise BundleError("the bundle is damaged")

    with pytest.raises(FulmarError, match="the bundle is damaged"):
        DrivenController(refuse)
    node = ControllerNode(refuse, lambda _code: None, cli_args=arguments("autostart:=false"))
    assert node.trigger_configure() == TransitionCallbackReturn.FAILURE


def test_a_controller_that_hangs_is_not_activated_again():
    driven = started()
    driven.node._beat = type("Hanging", (), {"hangs": True})()
    assert driven.node.on_activate(None) == TransitionCallbackReturn.FAILURE


def test_a_press_takes_the_goal_away():
    driven = started()
    driven.node._on_estop(Bool(data=True))
    assert not driven.see().any()
    driven.node._on_estop_released(None)
    assert not driven.see().any()
    assert driven.node.guard.mission.lacking == "goal"


def test_what_was_on_its_way_at_a_shutdown_is_left_out_and_a_press_is_received():
    """The executor delivers it all the same, and an error would end the process with exit code 1."""
    node = started().node
    node.trigger_shutdown()
    for receive, message in (
        (node._on_odometry, (b"",)),
        (node._on_applied, (b"",)),
        (node._on_goal, (PoseStamped(), {})),
        (node._on_obstacles, (MarkerArray(),)),
        (node._on_thing, ("block", PoseStamped())),
        (node._on_estop_released, (String(),)),
        (node._on_swap, (String(data="lqr"),)),
        (node._on_bearing, (Bool(data=True),)),
        (node._on_neighbours, (JointState(),)),
        (node._publish_idle_status, ()),
    ):
        receive(*message)
    node._on_estop(Bool(data=True))
    assert node._estop.reason(time.monotonic_ns())
