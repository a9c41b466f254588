"""A period is handed over when all its readings are there, in one order, once."""

from __future__ import annotations

import itertools

import pytest

from fulmar_core.wires.lockstep_period import PLANT, PeriodInbox

TOPICS = {"/r/mocap/pose": "mocap", "/r/imu/data": "imu"}
READINGS = [("/r/imu/data", 10), ("/r/imu/data", 20), ("/r/mocap/pose", 20)]


def inbox(**more) -> PeriodInbox[str]:
    return PeriodInbox(TOPICS, **more)


@pytest.mark.parametrize("order", itertools.permutations(range(4)))
def test_the_order_of_arrival_does_not_matter(order):
    box, found = inbox(), []
    for number in order:
        if number == 3:
            box.expect(PLANT, 20, {"/r/imu/data": 2, "/r/mocap/pose": 1, "/r/actuators/state": 1})
        else:
            topic, stamp = READINGS[number]
            box.add(topic, stamp, f"{TOPICS[topic]} {stamp}")
        found.append(box.take())
    assert found[:-1] == [None, None, None]
    assert found[-1] == (20, [("imu", "imu 10"), ("imu", "imu 20"), ("mocap", "mocap 20")])


def test_repetitions_count_once_and_those_of_an_old_period_not_at_all():
    box = inbox()
    box.expect(PLANT, 20, {"/r/imu/data": 2})
    for stamp in (10, 10):
        box.add("/r/imu/data", stamp, "first")
    assert box.take() is None
    box.add("/r/imu/data", 20, "second")
    assert box.take() == (20, [("imu", "first"), ("imu", "second")])
    box.add("/r/imu/data", 20, "again")
    box.expect(PLANT, 20, {"/r/imu/data": 2})
    assert (box.take(), box.answered_ns) == (None, 20)
    box.expect(PLANT, 40, {"/r/imu/data": 1})
    assert box.take() is None
    box.add("/r/imu/data", 40, "new")
    assert box.take() == (40, [("imu", "new")])


def test_a_topic_without_readings_in_a_period_is_not_waited_for():
    box = inbox()
    box.expect(PLANT, 20, {})
    assert box.take() == (20, [])


def test_a_node_that_takes_the_output_of_another_waits_for_its_answer_too():
    box = inbox(upstream=["camera"])
    box.add("/r/imu/data", 20, "imu")
    box.expect(PLANT, 20, {"/r/imu/data": 1})
    box.expect("stranger", 20, {"/r/mocap/pose": 5})
    assert box.take() is None
    box.expect("camera", 20, {"/r/mocap/pose": 1})
    assert box.take() is None
    box.add("/r/mocap/pose", 15, "pose")
    assert box.take() == (20, [("mocap", "pose"), ("imu", "imu")])
    box.expect("camera", 40, {})
    box.expect("camera", 20, {"/r/mocap/pose": 1})  # a late repetition
    box.expect(PLANT, 40, {})
    assert box.take() == (40, [])
