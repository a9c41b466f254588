"""Any message to markers, event cameras, satellites' controllers and the two sides of lock step: no node ends by it."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from types import SimpleNamespace
from unittest import mock

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import InertiaStamped, PoseStamped
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from visualization_msgs.msg import MarkerArray

from fulmar_bags.reading_messages import reader_of
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.wires.lockstep_period import counts_of
from fulmar_core.wires.robot_name import PLAIN
from fulmar_ros import reading_inputs
from fulmar_ros.lockstep_answer import LockstepAnswer
from fulmar_ros.markers_node import MarkersNode
from fulmar_ros.plant_period import PlantPeriod
from fulmar_ros.reading_inputs import ReadingInputs
from sim_nodes.event_camera_node import EventCameraNode
from tests.ros.any_message import any_message
from tests.ros.neighbour import NAMESPACE, Neighbour

FUZZ = settings(
    max_examples=40,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
CUBESAT = load_robot("cubesat_wheels")


@pytest.fixture
def markers(neighbour: Neighbour, monkeypatch: pytest.MonkeyPatch) -> Iterator[MarkersNode]:
    monkeypatch.setattr(sys, "argv", ["node"])
    node = MarkersNode(lambda _code: None, cli_args=["--ros-args", "-r", f"__ns:={NAMESPACE}"])
    yield node
    node.destroy_node()


@given(
    messages=st.lists(
        any_message(DiagnosticArray)
        | any_message(JointState)
        | any_message(PoseStamped)
        | any_message(MarkerArray),
        max_size=5,
    )
)
@FUZZ
def test_markers_are_drawn_whatever_they_are_made_of(markers: MarkersNode, messages: list[object]) -> None:
    takers = {
        DiagnosticArray: markers._on_status,
        JointState: markers._on_applied,
        PoseStamped: lambda message: markers._on_goal(message, {}),
        MarkerArray: lambda message: markers._on_obstacles(message, {}),
    }
    for message in messages:
        with np.errstate(all="ignore"):
            takers[type(message)](message)
            markers._draw()


@pytest.mark.parametrize("done", ["one", "-3", "", "9" * 400, "1e3", "²"])
def test_a_status_of_another_program_ends_no_markers(markers: MarkersNode, done: str) -> None:
    goal = PoseStamped()
    goal.header.frame_id, goal.pose.orientation.w = "odom", 1.0
    markers._on_goal(goal, {})
    markers._scene.give_status({"goals_done": done, "goal_stamp_ns": done})
    markers._draw()


@pytest.fixture
def cameras(neighbour: Neighbour, monkeypatch: pytest.MonkeyPatch) -> Iterator[EventCameraNode]:
    monkeypatch.setattr(sys, "argv", ["node"])
    node = EventCameraNode(lambda _code: None, cli_args=["--ros-args", "-r", f"__ns:={NAMESPACE}"])
    yield node
    node.destroy_node()


def test_event_cameras_see_nothing_from_a_state_that_is_none(cameras: EventCameraNode) -> None:
    for k, w in enumerate((1.0, float("nan"), 0.0, 1e300, 1.0)):
        message = Odometry()
        message.header.stamp.sec, message.header.stamp.nanosec = 5, 50_000_000 * k
        message.pose.pose.orientation.w = w
        cameras._on_truth(message)


@given(messages=st.lists(any_message(JointState) | any_message(InertiaStamped), max_size=6))
@FUZZ
def test_a_controller_of_a_satellite_gets_no_speed_and_no_inertia_that_cannot_be(
    messages: list[object],
) -> None:
    node = SimpleNamespace(
        create_subscription=lambda *_given, **_named: SimpleNamespace(destroy=lambda: None)
    )
    with mock.patch.object(reading_inputs, "subscribe_every", lambda *_given, **_named: []):
        inputs = ReadingInputs(
            node, CUBESAT, ("wheels", "inertia"), lambda: None, frames=PLAIN, lockstep=False
        )
    read = {name: reader_of(kind) for name, kind in inputs.newest.kinds.items()}
    for message in messages:
        name = "wheels" if isinstance(message, JointState) else "inertia"
        with np.errstate(all="ignore"):
            inputs._take(name, read[name], message)
        found = inputs.newest.at(0)
        assert np.abs(found.get("wheels", np.zeros(1))).max() < 1.3 * CUBESAT.actuators.top_speed
        assert np.isfinite(found.get("inertia", np.zeros(1))).all()


@given(messages=st.lists(any_message(JointState), min_size=1, max_size=6))
@FUZZ
def test_neither_side_of_lock_step_ends_by_what_a_stranger_counts(
    neighbour: Neighbour, messages: list[JointState]
) -> None:
    node = neighbour.node
    answer = LockstepAnswer(node, {"/a": "a"}, lambda _stamp, _readings: [], [])
    plant = PlantPeriod(node, ["estimator"], threading.Condition())
    for message in messages:
        answer._on_period(message)
        answer._on_answer(message)
        plant._on_answer(message)


def test_values_that_are_no_counts_are_left_out() -> None:
    values = (3.0, float("nan"), float("inf"), -1.0, 1e300)
    assert counts_of("abcde", values) == {"a": 3}
