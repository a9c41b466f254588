"""Which messages make a ring recorder write."""

from __future__ import annotations

import pytest

from fulmar_bags.message_types import type_store
from fulmar_bags.ring import fault_finder
from fulmar_core.robots.topics import DIAGNOSTICS, ESTOP, ODOMETRY, STATUS

TOPICS = {
    STATUS: "/it/controller/status",
    DIAGNOSTICS: "/diagnostics",
    ESTOP: "/it/estop",
    ODOMETRY: "/it/odom",
}


@pytest.fixture
def fault_in():
    return fault_finder("it", TOPICS)


def diagnostics(name: str, level: int, message: str = "bad") -> bytes:
    types = type_store().types
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="")
    status = types["diagnostic_msgs/msg/DiagnosticStatus"](
        level=level, name=name, message=message, hardware_id="", values=[]
    )
    array = types[DIAGNOSTICS.type](header=header, status=[status])
    return bytes(type_store().serialize_cdr(array, DIAGNOSTICS.type))


def stop(on: bool) -> bytes:
    return bytes(type_store().serialize_cdr(type_store().types[ESTOP.type](data=on), ESTOP.type))


def test_an_error_of_the_plant_is_a_fault_with_its_words(fault_in):
    words = "no command for 400 ms (limit 200 ms): actuators in their safe state"
    assert fault_in("/diagnostics", diagnostics("it: plant", 2, words)) == f"plant: {words}"


def test_a_fault_of_the_controller_is_one(fault_in):
    assert fault_in("/it/controller/status", diagnostics("it: controller", 2)) == "controller: bad"


@pytest.mark.parametrize("level", [0, 1])
def test_a_warning_is_none(fault_in, level):
    assert fault_in("/diagnostics", diagnostics("it: plant", level)) == ""


def test_another_robot_s_error_is_none(fault_in):
    assert fault_in("/diagnostics", diagnostics("other: plant", 2)) == ""


def test_the_recorder_s_own_trouble_is_none(fault_in):
    assert fault_in("/diagnostics", diagnostics("it: recorder", 2)) == ""


def test_the_e_stop_is_a_fault_while_it_says_stop(fault_in):
    assert fault_in("/it/estop", stop(True)) == "e-stop"
    assert fault_in("/it/estop", stop(False)) == ""


def test_other_topics_and_torn_messages_are_none(fault_in):
    assert fault_in("/it/odom", diagnostics("it: plant", 2)) == ""
    assert fault_in("/diagnostics", diagnostics("it: plant", 2)[:20]) == ""
    assert fault_in("/diagnostics", b"") == ""
