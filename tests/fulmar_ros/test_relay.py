"""What an operator sent once reaches the nodes that its publisher had not found yet."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from geometry_msgs.msg import PointStamped
from rclpy.serialization import serialize_message
from std_msgs.msg import Bool, String, UInt8MultiArray

from fulmar_core.robots.topics import ESTOP, GOAL_POINT, SWAP
from fulmar_ros import relay
from fulmar_ros.relay import FIRST, HOLD_S, Relay, RelayedInputs


class Wired:
    """A node whose only publisher reaches its only subscription."""

    def __init__(self) -> None:
        self.passed_on: list[UInt8MultiArray] = []
        self._receive: Any = None
        self._numbers = 0

    def create_publisher(self, _kind: type, _topic: str, _qos: Any) -> Any:
        return SimpleNamespace(publish=self.passed_on.append)

    def create_subscription(
        self, _kind: type, _topic: str, callback: Any, _qos: Any, *, raw: bool, event_callbacks: Any
    ) -> None:
        self._receive = callback

    def receive(self, message: UInt8MultiArray) -> None:
        self._numbers += 1
        self._receive(message, {"source_timestamp": 1, "publication_sequence_number": self._numbers})

    def deliver(self) -> None:
        for message in self.passed_on:
            self.receive(message)
        self.passed_on.clear()


class Clock:
    now_s = 100.0

    def monotonic(self) -> float:
        return self.now_s

    def time_ns(self) -> int:
        return round(1e9 * self.now_s)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(relay, "time", made)
    return made


def info(number: int = 1, sent_ns: int = 100_000_000_007, received_s: float = 100.0) -> dict[str, int]:
    return {
        "source_timestamp": sent_ns,
        "publication_sequence_number": number,
        "received_timestamp": round(1e9 * received_s),
    }


def goal(x: float) -> PointStamped:
    message = PointStamped()
    message.point.x = x
    return message


@pytest.fixture
def wired(clock: Clock) -> Any:
    """A recorder that received, and a controller that did not; with what the controller took."""
    node = Wired()
    listener, taken = RelayedInputs(node), []
    direct = listener.receiver(PointStamped, GOAL_POINT, lambda message, _info: taken.append(message.point.x))
    pressed: list[bool] = []
    button = listener.receiver(Bool, ESTOP, lambda message, _info: pressed.append(message.data))

    def after(seconds: float) -> list[float]:
        clock.now_s += seconds
        listener.look()
        return taken

    return SimpleNamespace(
        node=node, relay=Relay(node), listener=listener, direct=direct, after=after, pressed=pressed,
        button=button,
    )  # fmt: skip


@pytest.mark.parametrize("raw", [False, True])
def test_a_goal_that_another_node_alone_received_is_taken(wired, raw):
    message = serialize_message(goal(3.0)) if raw else goal(3.0)
    wired.relay.relaying(GOAL_POINT, lambda *_: None)(message, info())
    wired.node.deliver()
    assert wired.after(0.5 * HOLD_S) == []
    assert wired.after(HOLD_S) == [3.0]
    wired.direct(goal(3.0), info())  # it comes by itself after all
    assert wired.after(HOLD_S) == [3.0]


def test_a_goal_that_came_by_itself_is_not_taken_again(wired):
    wired.direct(goal(3.0), info())
    wired.relay.send(GOAL_POINT, goal(3.0), info())
    wired.node.deliver()
    assert wired.after(2.0 * HOLD_S) == [3.0]


def test_a_newer_goal_takes_the_place_of_one_that_others_received(wired):
    wired.relay.send(GOAL_POINT, goal(3.0), info(1))
    wired.node.deliver()
    wired.direct(goal(4.0), info(2))
    assert wired.after(2.0 * HOLD_S) == [4.0]


def test_after_an_e_stop_nothing_is_taken_that_was_held_before(wired):
    wired.relay.send(GOAL_POINT, goal(3.0), info())
    wired.node.deliver()
    wired.listener.forget()
    assert wired.after(2.0 * HOLD_S) == []


def test_a_press_that_another_node_alone_received_counts_at_once_and_a_release_never(wired):
    wired.relay.send(ESTOP, Bool(data=False), info(1))
    wired.node.deliver()
    assert wired.pressed == []
    wired.relay.send(ESTOP, Bool(data=True), info(2))
    wired.node.deliver()
    assert wired.pressed == [True]


@pytest.mark.parametrize(
    ("what", "details"),
    [
        ("one of many", info(number=FIRST + 1)),
        ("without a source time", info(sent_ns=0)),
        ("held back by this computer", info(received_s=98.0)),
        ("kept by its publisher for those to come", info(sent_ns=98_000_000_000)),
    ],
)
def test_other_messages_are_not_passed_on(wired, what, details):
    wired.relay.send(GOAL_POINT, goal(3.0), details)
    assert wired.node.passed_on == []


def test_what_only_operators_may_ask_for_is_not_passed_on(wired):
    wired.relay.relaying(SWAP, lambda *_: None)(String(data="bundle"), info())
    assert wired.node.passed_on == []


@pytest.mark.parametrize("label", ["", "goal_point", "goal_point x 1", "joy 7 1", "goal_point 7 1"])
def test_what_is_no_message_of_a_wire_is_ignored(wired, label):
    message = UInt8MultiArray(data=b"rubbish")
    if label:
        wired.relay.send(GOAL_POINT, goal(3.0), info())
        message.layout = wired.node.passed_on.pop().layout
        message.layout.dim[0].label = label
    wired.node.receive(message)
    assert wired.after(2.0 * HOLD_S) == []


def test_a_press_that_came_by_way_of_others_is_taken_and_not_passed_on_once_more(wired):
    taken: list[bool] = []
    both = Relay(wired.node).relaying(ESTOP, lambda message, _info: taken.append(message.data))
    wired.listener.receiver(Bool, ESTOP, both)
    wired.relay.send(ESTOP, Bool(data=True), info(2))
    wired.node.deliver()
    assert taken == [True]
    assert not wired.node.passed_on
