"""Messages of operator wires, delivered by two subscriptions, are passed on once."""

from __future__ import annotations

import inspect

from fulmar_ros import operator_subscription
from fulmar_ros.operator_subscription import Once, with_message_info


def info(sent_ns: int, number: int) -> dict[str, int]:
    return {"source_timestamp": sent_ns, "publication_sequence_number": number}


def test_the_second_delivery_of_a_message_is_dropped_by_every_executor():
    got: list[str] = []
    once = with_message_info(Once(got.append, with_info=False).pass_on)
    once("a", info(5, 1))  # message and info as two arguments, or as one tuple
    once(("a", info(5, 1)))
    once(("a", info(6, 2)))  # the same content, sent again
    once("b", info(5, 2))  # of another publisher, in the same nanosecond
    assert got == ["a", "a", "b"]


def test_a_callback_receives_the_message_info_from_every_executor():
    got: list[tuple[str, dict[str, int]]] = []
    callback = with_message_info(lambda message, about: got.append((message, about)))
    assert len(inspect.signature(callback).parameters) == 2, "else rclpy passes no info"
    callback("a", info(5, 1))
    callback(("b", info(6, 2)))
    assert got == [("a", info(5, 1)), ("b", info(6, 2))]


def test_without_a_time_of_sending_no_message_is_lost():
    got: list[str] = []
    once = Once(got.append, with_info=False)
    for _ in range(2):
        once.pass_on("press", info(0, 0))
    assert got == ["press"] * 2


def test_the_info_is_passed_on_where_it_is_asked_for():
    got: list[tuple[str, dict[str, int]]] = []
    Once(lambda message, about: got.append((message, about)), with_info=True).pass_on("a", info(5, 1))
    assert got == [("a", info(5, 1))]


def test_its_memory_is_bounded():
    once = Once(lambda _message: None, with_info=False)
    for number in range(operator_subscription.REMEMBERED + 10):
        once.pass_on("a", info(7, number))
    assert len(once._known) == len(once._order) == operator_subscription.REMEMBERED
