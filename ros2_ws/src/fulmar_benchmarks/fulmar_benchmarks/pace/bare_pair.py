"""One of two nodes that publish the messages of a control step and wait for each other; they compute nothing."""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message

from fulmar_core.robots.topics import ODOMETRY
from fulmar_ros.message_class import needed_class
from fulmar_ros.runtime import ros_node

DEPTH = 50  # messages that a reader may lag behind
ANSWERS_S, SETTLES_S = (
    10.0,
    0.3,
)  # longest wait for an answer; a publisher sees a match before its reader is ready
WARM_UP = 200  # steps that are not timed
Message = tuple[str, str, str, int]


class Side:
    """Publishers of one side's messages, and subscriptions of the other's."""

    def __init__(
        self, node: Node, own: list[Message], others: list[Message], way: str, on_first: Callable[[], None]
    ) -> None:
        """Create the endpoints; `on_first` is called with the first message of each step of the other side."""
        qos, raw = QoSProfile(depth=DEPTH), way == "raw"
        self._sent: list[tuple[Publisher, Any]] = []
        for topic, kind, text, times in own:
            cls, data = _class_of(topic, kind), bytes.fromhex(text)
            publisher = node.create_publisher(cls, topic, qos)
            self._sent += [(publisher, data if raw else deserialize_message(data, cls))] * times
        for number, (topic, kind, *_) in enumerate(others):
            callback = _ignore if number else lambda _message: on_first()
            node.create_subscription(_class_of(topic, kind), topic, callback, qos, raw=raw)

    def wait_for_reader(self) -> None:
        """Wait until everything that is published has a reader."""
        while not all(publisher.get_subscription_count() for publisher, _ in self._sent):
            time.sleep(0.01)
        time.sleep(SETTLES_S)

    def send(self) -> None:
        """Publish what belongs to one step."""
        for publisher, message in self._sent:
            publisher.publish(message)


def _ignore(_message: Any) -> None:
    pass


def _class_of(topic: str, kind: str) -> Any:
    return needed_class(replace(ODOMETRY, name=topic, type=kind))


def main(path: str, way: str, steps: str, role: str) -> None:
    """Be one side; as `plant`, print how long the steps took [s]."""
    messages = json.loads(Path(path).read_text())
    failed, answered = threading.Event(), threading.Semaphore(0)
    with ros_node(f"bare_{role}", lambda _error: failed.set()) as node:
        if role == "controller":
            side = Side(node, messages["controller"], messages["plant"], way, lambda: side.send())
            failed.wait()
            return
        side = Side(node, messages["plant"], messages["controller"], way, answered.release)
        side.wait_for_reader()
        began_s = time.perf_counter()
        for step in range(WARM_UP + int(steps)):
            if step == WARM_UP:
                began_s = time.perf_counter()
            side.send()
            if not answered.acquire(timeout=ANSWERS_S):
                sys.exit("no answer")
        took_s = time.perf_counter() - began_s
    sys.stdout.write(f"{took_s}\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
