"""Publishers that do not fit a wire, named with their topic."""

from __future__ import annotations

from fulmar_core.robots.topics import ESTOP
from fulmar_core.robots.wire_check import Offer, wire_problems

GOOD = Offer("/rviz", ESTOP.type, reliable=True, latched=False)
OTHER = Offer("/panel", "std_msgs/msg/Int8", reliable=True, latched=True)
LOSSY = Offer("/gamepad", ESTOP.type, reliable=False, latched=False)


def problems(*offers, reliable=True):
    return wire_problems(ESTOP, "/boat/estop", offers, reliable=reliable)


def test_a_volatile_or_latched_publisher_of_the_right_type_fits():
    assert problems(GOOD, Offer("/node", ESTOP.type, reliable=True, latched=True)) == []


def test_another_type_is_named_with_its_publisher_and_topic():
    assert problems(GOOD, OTHER) == [
        "/panel publishes std_msgs/msg/Int8 on /boat/estop, must be std_msgs/msg/Bool: nothing of it arrives"
    ]


def test_best_effort_does_not_reach_reliable_subscribers_and_does_reach_others():
    assert problems(LOSSY) == [
        "/gamepad publishes best effort on /boat/estop, must be reliable: nothing of it arrives"
    ]
    assert problems(LOSSY, reliable=False) == []


def test_two_publishers_of_one_node_are_one_problem():
    assert len(problems(LOSSY, LOSSY)) == 1
