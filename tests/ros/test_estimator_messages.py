"""Any message on any wire that any estimator takes: it is used, or refused in words, and the node goes on.

Handlers are called directly, with real messages, on real nodes: DDS would only slow the search down.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sensor_msgs.msg import JointState, PointCloud2

from fulmar_bags.reading_messages import reader_of
from fulmar_core.dynamics.sky.events import Events
from fulmar_core.estimators.kinds import KINDS
from fulmar_core.estimators.readings import READINGS
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import SENSOR_WIRES
from fulmar_ros.convert import stamp_of
from fulmar_ros.estimator_node import BROKEN, EstimatorNode
from fulmar_ros.event_packets import cloud_of_events
from fulmar_ros.message_class import needed_class
from tests.ros.any_message import any_message, numbers
from tests.ros.neighbour import Neighbour

pytest.importorskip("filterpy")
FUZZ = settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
FILES = {
    "planar_motion": ("mocap_imu", "floating_platform"),
    "spatial_motion": ("mocap_imu_3d", "spacecraft_16"),
    "attitude": ("attitude", "cubesat_wheels"),
    "inertia": ("inertia", "cubesat_wheels"),
    "event_rate": ("event_rate", "cubesat_wheels"),
}
WHEELS = list(load_robot("cubesat_wheels").actuators.wheel_names)
BEGIN_NS = 1_000_000_000_000


@st.composite
def messages_of(draw: st.DrawFn, wire: Any, cls: Any) -> Any:
    """Any message of a wire, often near to one that its estimator takes."""
    message = draw(any_message(cls))
    if cls is PointCloud2 and draw(st.booleans()):
        message = draw(packets())
    if draw(st.booleans()):
        message.header.stamp = stamp_of(BEGIN_NS + 50_000_000 * draw(st.integers(0, 20)))
    if cls is JointState and wire is SENSOR_WIRES["wheels"] and draw(st.booleans()):
        message.name, message.velocity = WHEELS, draw(st.lists(numbers, min_size=3, max_size=3))
    return message


@st.composite
def packets(draw: st.DrawFn) -> PointCloud2:
    count = draw(st.integers(0, 30))
    ints = np.random.default_rng(draw(st.integers(0, 99)))
    end_ns = BEGIN_NS + 50_000_000 * draw(st.integers(0, 20))
    begin_ns = max(0, end_ns - draw(st.sampled_from([50_000_000, 1, 10**12])))
    t = np.sort(ints.integers(begin_ns, end_ns + 1, count)).astype(np.uint64)
    p = ints.integers(0, draw(st.sampled_from([2, 2, 256])), count).astype(np.uint8)
    p = np.where(p == 0, draw(st.sampled_from([0, 0, 255])), p).astype(np.uint8)
    xy = ints.integers(0, draw(st.sampled_from([1024, 65536])), (2, count)).astype(np.uint16)
    return cloud_of_events(Events(*xy, t, p, 1024, 1024), end_ns, "camera")


@pytest.fixture(params=list(FILES))
def estimating(
    neighbour: Neighbour, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[str, EstimatorNode]]:
    monkeypatch.setattr(sys, "argv", ["node"])
    name, robot = FILES[request.param]
    words = ["--ros-args", "-p", f"robot:={robot}", "-p", f"estimator:={name}"]
    node = EstimatorNode(lambda _code: None, cli_args=words)
    yield request.param, node
    node.destroy_node()


def test_every_kind_of_estimator_is_tried():
    assert set(FILES) == set(KINDS)


@given(data=st.data())
@FUZZ
def test_no_message_on_any_wire_breaks_an_estimator(
    estimating: tuple[str, EstimatorNode], data: st.DataObject
) -> None:
    kind, node = estimating
    wires = KINDS[kind].readings
    node._estimator.reset()
    for name in data.draw(st.lists(st.sampled_from(list(wires)), min_size=1, max_size=12)):
        read = reader_of(READINGS[name])
        message = data.draw(messages_of(wires[name], needed_class(wires[name])))
        refused = node._refused
        with np.errstate(all="ignore"):
            node._on_message(name, wires[name].name, read, message)
        assert not node._refusal.startswith(BROKEN), node._refusal
        assert node._refused in (refused, refused + 1)


def test_a_node_whose_estimator_raises_says_so_and_begins_anew(
    estimating: tuple[str, EstimatorNode], monkeypatch: pytest.MonkeyPatch
) -> None:
    kind, node = estimating
    name, wire = next(iter(KINDS[kind].readings.items()))

    def breaks(*_given: object) -> None:
        raise ZeroDivisionError("of a test")

    message = needed_class(wire)()
    monkeypatch.setattr(node._estimator, "take", breaks)
    monkeypatch.setattr("fulmar_ros.estimator_node.reading_problem", lambda *_given: "")
    node._on_message(name, wire.name, lambda *_given: object(), message)
    assert node._refused == 1
    assert node._refusal == f"{BROKEN} '{name}': ZeroDivisionError: of a test"
    node._publish_status()
