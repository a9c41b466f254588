"""A recorder that keeps a ring: what it writes of a fault, and when the disk is full."""

from __future__ import annotations

import resource
import signal
import time

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from rosbags.highlevel import AnyReader
from std_msgs.msg import Bool, String

from fulmar_core.robots.topics import ESTOP, METADATA
from fulmar_ros.qos import publisher_qos
from tests.ros.recorder import ROBOT, odometry, publish, wait_for

pytestmark = pytest.mark.real_time


@pytest.mark.slow
def test_a_ring_without_a_fault_leaves_nothing(record, node):
    recorder = record("mode:=ring")
    recorder.wait_until_recording("keeping 30 s for")
    publish(odometry(node), range(100))
    code, out, err = recorder.end(signal.SIGINT)
    assert (code, err) == (0, "")
    assert "no fault in" in out
    assert not recorder.directory.exists()


@pytest.mark.slow
def test_a_ring_writes_the_goal_and_what_was_before_and_after_a_fault(record, node):
    recorder = record("mode:=ring", "before_fault_s:=0.5", "after_fault_s:=0.3")
    recorder.wait_until_recording("keeping 0.5 s for")
    metadata = node.create_publisher(String, METADATA.name, publisher_qos(METADATA))
    stop = node.create_publisher(Bool, ESTOP.name, publisher_qos(ESTOP))
    publisher = odometry(node)
    metadata.publish(String(data="who"))
    publish(publisher, range(100), period_s=0.01)
    stop.publish(Bool(data=True))
    publish(publisher, range(100, 200), period_s=0.01)
    assert recorder.end(signal.SIGINT)[0] == 0
    stamps = recorder.stamps_by_rosbags()
    assert stamps == list(range(stamps[0], stamps[-1] + 1))
    assert stamps[0] >= 25, "half a second before the stop, and not the beginning"
    assert 100 < stamps[-1] < 190, "a third of a second after it, and not the end"
    with AnyReader([recorder.directory]) as reader:
        held = [c.topic for c, _, _ in reader.messages() if c.topic == f"{ROBOT}/{METADATA.name}"]
    assert len(held) == 1


@pytest.mark.slow
def test_a_ring_on_a_full_disk_writes_its_fault_when_there_is_room(record, node, healths):
    recorder = record("mode:=ring", "before_fault_s:=5.0", "after_fault_s:=0.3")
    recorder.wait_until_recording("keeping 5 s for")
    stop = node.create_publisher(Bool, ESTOP.name, publisher_qos(ESTOP))
    publisher = odometry(node)
    limit = recorder.process.pid, resource.RLIMIT_FSIZE
    resource.prlimit(*limit, (0, resource.RLIM_INFINITY))
    publish(publisher, range(10))
    stop.publish(Bool(data=True))
    wait_for(lambda: healths and "cannot write a bag here" in healths[-1].message)
    assert healths[-1].level == DiagnosticStatus.ERROR
    resource.prlimit(*limit, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    wait_for(lambda: list(recorder.directory.glob("*.mcap")))
    assert recorder.end(signal.SIGINT)[0] == 0
    assert recorder.stamps_by_rosbags() == list(range(10))


def test_a_ring_that_never_got_room_ends_in_exit_code_1_with_a_reason(record, node):
    recorder = record("mode:=ring")
    recorder.wait_until_recording("keeping 30 s for")
    publisher = node.create_publisher(Bool, ESTOP.name, publisher_qos(ESTOP))
    resource.prlimit(recorder.process.pid, resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))
    while not publisher.get_subscription_count():
        time.sleep(0.01)
    time.sleep(0.3)  # a publisher knows of a match a moment before the subscriber does
    publisher.publish(Bool(data=True))
    time.sleep(0.5)
    code, _, err = recorder.end(signal.SIGINT)
    assert code == 1
    assert "cannot write a bag here" in err
    assert "messages are not in the bag" in err
    assert "Traceback" not in err
