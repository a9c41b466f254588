"""Commands under way: each looks at what has come back, until it can answer."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Protocol

from rclpy.client import Client
from rclpy.node import Node
from rclpy.publisher import Publisher
from std_msgs.msg import String

from fulmar_console.source import Answer
from fulmar_core.robots.topics import Wire
from fulmar_ros.qos import publisher_qos, subscriber_qos

ASK_AGAIN_S = 1.0  # between two requests on a topic [s]
MOST_ASKED = 3  # times; each has the same id, so that it is done once
FOUND_S, ANSWER_S = 2.0, 3.0  # for a service or who answers to be found, and to answer [s]
RESULTS_KEPT = 100  # of other clients too


class Pending(Protocol):
    """A command under way."""

    def step(self, now_s: float) -> bool:
        """Look, and go on; returns whether it is over. `now_s` is the monotonic clock's [s]."""


class Call:
    """Calls a service, and answers with its words."""

    def __init__(
        self, client: Client, request: Any, answer: Answer, words: str, *, answer_s: float = ANSWER_S
    ) -> None:
        """Call once it is found.

        Args:
            client: Of the service.
            request: Of its type.
            answer: Takes the result.
            words: What was done, for a service that has no words of its own.
            answer_s: Longest wait for the answer [s].
        """
        self._client, self._request, self._answer, self._words = client, request, answer, words
        self._began_s, self._answer_s = time.monotonic(), answer_s
        self._future: Any = None

    def step(self, now_s: float) -> bool:
        """Call, or look for the answer."""
        if self._future is None:
            if self._client.service_is_ready():
                self._future, self._began_s = self._client.call_async(self._request), now_s
            elif now_s - self._began_s > FOUND_S:
                self._answer(False, f"no node offers {self._client.srv_name}: is the robot's plant running?")
                return True
            return False
        if self._future.done():
            result = self._future.result()
            words = getattr(result, "message", "")
            refused = f"{self._client.srv_name} refuses: it is in another state"
            self._answer(result.success, words or (self._words if result.success else refused))
            return True
        if now_s - self._began_s > self._answer_s:
            self._client.remove_pending_request(self._future)
            self._answer(False, f"no answer on {self._client.srv_name} within {self._answer_s:g} s")
            return True
        return False


class Requests:
    """Requests as JSON on topics, whose answers have their ids: `controller/swap` and the simulation's."""

    def __init__(self, node: Node) -> None:
        """Ask in a node's name."""
        self._node, self._count = node, 0
        self._publishers: dict[str, Publisher] = {}
        self._results: dict[str, dict[str, dict[str, Any]]] = {}

    def ask(
        self,
        space: str,
        wires: tuple[Wire, Wire],
        content: Mapping[str, Any],
        answer: Answer,
        within_s: float,
    ) -> Ask:
        """Ask on the first wire of a robot, and wait for the answer on the second.

        Args:
            space: Namespace of the robot.
            wires: Of request and result.
            content: Beside the id.
            answer: Takes the result.
            within_s: Longest wait [s].
        """
        request, result = (f"{space}/{wire.name}" for wire in wires)
        if request not in self._publishers:
            qos = publisher_qos(wires[0])
            self._publishers[request] = self._node.create_publisher(String, request, qos)
        if result not in self._results:
            self._results[result] = {}
            take = self._taker(self._results[result])
            self._node.create_subscription(
                String, result, take, subscriber_qos(wires[1], reliable=True, depth=10)
            )
        self._count += 1
        name = f"{self._node.get_name()}-{self._count}"
        message = String(data=json.dumps({"id": name, **content}))
        answers = partial(self._node.count_publishers, result)
        return Ask(self._publishers[request], message, name, self._results[result], answers, answer, within_s)

    @staticmethod
    def _taker(results: dict[str, dict[str, Any]]) -> Callable[[String], None]:
        def take(message: String) -> None:
            try:
                content = json.loads(message.data)
                results[str(content["id"])] = content
            except (ValueError, KeyError, TypeError, RecursionError):
                return  # another client's, of another form
            while len(results) > RESULTS_KEPT:
                del results[next(iter(results))]

        return take


class Ask:
    """One request on a topic, repeated until it is answered: the first may come before the two have met."""

    def __init__(
        self, publisher: Publisher, message: String, name: str, results: dict[str, dict[str, Any]],
        answering: Callable[[], int], answer: Answer, within_s: float,
    ) -> None:  # fmt: skip
        """Ask at the first step.

        `name` is the id under which `results` will have the answer, `answering` counts nodes that publish answers.
        """
        self._publisher, self._message, self._name, self._results = publisher, message, name, results
        self._answering, self._answer, self._within_s = answering, answer, within_s
        self._began_s, self._said_s, self._count = time.monotonic(), 0.0, 0

    def step(self, now_s: float) -> bool:
        """Ask again, or answer."""
        result = self._results.pop(self._name, None)
        topic, waited_s = self._publisher.topic_name, now_s - self._began_s
        if result is not None:
            self._answer(bool(result.get("accepted")), str(result.get("reason") or ""))
            return True
        there = self._publisher.get_subscription_count() and self._answering()
        if waited_s > self._within_s or (not there and waited_s > FOUND_S):
            self._answer(False, f"no node answers requests on {topic} (waited {waited_s:.0f} s)")
            return True
        if there and self._count < MOST_ASKED and now_s - self._said_s > ASK_AGAIN_S:
            self._said_s, self._count = now_s, self._count + 1
            self._publisher.publish(self._message)
        return False


class Steps:
    """Calls one service several times in a row, such as single steps of a simulation."""

    def __init__(self, call: Callable[[Answer], Call], count: int, answer: Answer) -> None:
        """Begin with the first; `call` makes one of them."""
        self._call, self._left, self._answer = call, count, answer
        self._now = call(self._take)

    def _take(self, done: bool, words: str) -> None:
        self._left -= 1
        if not done or not self._left:
            self._left = 0
            self._answer(done, words)

    def step(self, now_s: float) -> bool:
        """Go on with the one under way, or the next."""
        if self._now.step(now_s) and self._left:
            self._now = self._call(self._take)
        return not self._left


class InThread:
    """Something that waits, in a thread of its own, and returns whether it was done and words."""

    def __init__(
        self, work: Callable[..., tuple[bool, str]], arguments: Sequence[Any], answer: Answer
    ) -> None:
        """Begin."""
        self._answer = answer
        self._thread = threading.Thread(target=self._run, args=(work, arguments), daemon=True)
        self._thread.start()

    def _run(self, work: Callable[..., tuple[bool, str]], arguments: Sequence[Any]) -> None:
        try:
            self._answer(*work(*arguments))
        except Exception as error:  # noqa: BLE001 - the person who asked is told, whatever it is
            self._answer(False, f"{type(error).__name__}: {error}")

    def step(self, now_s: float) -> bool:
        """Whether it has ended."""
        return not self._thread.is_alive()
