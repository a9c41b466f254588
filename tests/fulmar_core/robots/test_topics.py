"""The table of wires."""

from __future__ import annotations

import pytest

from fulmar_core.robots.topics import (
    BROADCAST_NAMES,
    BROADCAST_VALUES,
    GOAL_WIRES,
    SIMULATION_START_NS,
    STATUS,
    WIRES,
)
from fulmar_core.tasks import GoToPose, GoToPosition


def test_no_topic_is_listed_twice():
    assert len({wire.name for wire in WIRES}) == len(WIRES)


def test_every_wire_of_the_module_is_in_the_table():
    from fulmar_core.robots import topics

    named = [value for value in vars(topics).values() if isinstance(value, topics.Wire)]
    named += topics.SENSOR_WIRES.values()
    assert {wire.name for wire in named} == {wire.name for wire in WIRES}


@pytest.mark.parametrize("wire", WIRES, ids=lambda wire: wire.name)
def test_every_type_is_a_standard_message_of_jazzy(wire):
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    assert wire.type in store.types or wire in (
        BROADCAST_NAMES,
        BROADCAST_VALUES,
    )  # of ros2_control, where asked for


def test_every_task_s_goal_has_a_wire():
    for task in (GoToPose, GoToPosition):
        assert GOAL_WIRES[task.goal_topic].source == "operator"
        assert GOAL_WIRES[task.goal_topic].delivery == "latched"


def test_what_a_latecomer_needs_is_latched():
    assert STATUS.delivery == "latched"


def test_simulated_time_begins_at_a_stamp_that_ros_takes_for_one():
    assert SIMULATION_START_NS > 0
