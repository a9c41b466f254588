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


def answered(stamp_ns: int) -> PeriodInbox[str]:
    """An inbox whose first period has been handed over."""
    box = inbox()
    box.expect(PLANT, stamp_ns, {})
    assert box.take() == (stamp_ns, [])
    return box


IN_ORDER = [("imu", "imu 10"), ("mocap", "mocap 10"), ("imu", "imu 20"), ("mocap", "mocap 20")]


@pytest.mark.parametrize("topics", set(itertools.permutations(["imu", "imu", "mocap", "mocap"])))
def test_readings_go_first_that_nothing_can_go_before_and_the_order_stays(topics):
    box, found = answered(0), []
    paths = {name: topic for topic, name in TOPICS.items()}
    stamps = {"imu": iter((10, 20)), "mocap": iter((10, 20))}
    for name in topics:
        stamp = next(stamps[name])
        box.add(paths[name], stamp, f"{name} {stamp}")
        found += box.ready()
    assert found == IN_ORDER  # each topic has said its last
    assert box.take() is None
    box.expect(PLANT, 20, {path: 2 for path in TOPICS})
    assert box.take() == (20, [])


def test_what_goes_first_waits_for_every_topic_and_counts_for_its_period():
    box = answered(0)
    box.add("/r/imu/data", 10, "imu 10")
    assert box.ready() == []  # an older pose may come
    box.add("/r/mocap/pose", 15, "mocap 15")
    assert box.ready() == [("imu", "imu 10")]
    box.add("/r/imu/data", 10, "imu 10")  # repeated
    box.add("/r/imu/data", 20, "imu 20")
    assert box.ready() == [("mocap", "mocap 15")]
    box.expect(PLANT, 20, {"/r/imu/data": 2, "/r/mocap/pose": 1})
    assert box.take() == (20, [("imu", "imu 20")])
    box.add("/r/mocap/pose", 15, "mocap 15")
    box.add("/r/imu/data", 30, "imu 30")
    assert box.ready() == []


def test_nothing_goes_first_before_the_first_answer_or_beside_another_node():
    for box in (inbox(), inbox(upstream=["camera"])):
        for topic in TOPICS:
            box.add(topic, 10, topic)
        assert box.ready() == []


def test_a_reading_that_got_lost_is_taken_when_the_period_is_repeated():
    box = answered(0)
    box.add("/r/imu/data", 20, "imu 20")  # that of 10 is lost
    box.add("/r/mocap/pose", 20, "mocap 20")
    assert box.ready() == [("imu", "imu 20"), ("mocap", "mocap 20")]
    box.expect(PLANT, 20, {"/r/imu/data": 2, "/r/mocap/pose": 1})
    assert box.take() is None
    for topic, stamp in (("/r/imu/data", 10), ("/r/imu/data", 20), ("/r/mocap/pose", 20)):
        box.add(topic, stamp, f"{TOPICS[topic]} {stamp}")
    assert box.take() == (20, [("imu", "imu 10")])


def test_a_topic_of_a_sensor_that_the_robot_lacks_is_not_waited_for():
    topics = TOPICS | {"/r/attitude": "star_tracker"}
    for silent, found in (((), []), (["/r/attitude"], [("imu", "imu 10"), ("mocap", "mocap 10")])):
        box = PeriodInbox[str](topics, silent=silent)
        box.expect(PLANT, 0, {})
        assert box.take() == (0, [])
        for topic, name in TOPICS.items():
            box.add(topic, 10, f"{name} 10")
        assert box.ready() == found
    box.add("/r/attitude", 5, "attitude 5")  # from whoever sends it after all
    box.expect(PLANT, 10, {topic: 1 for topic in topics})
    assert box.take() == (10, [("star_tracker", "attitude 5")])
