"""Subscriptions of what a controller takes beside the odometry, by the names that it gives."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from rclpy.node import Node
from rclpy.subscription import Subscription

from fulmar_bags.image_bytes import read_image
from fulmar_bags.message_reader import stamp_ns
from fulmar_bags.reading_messages import Read, reader_of
from fulmar_core.loop.newest_readings import NewestReadings
from fulmar_core.robots.robot import Robot
from fulmar_core.wires.robot_name import Frames
from fulmar_ros.message_class import needed_class
from fulmar_ros.operator_subscription import destroy_all, subscribe_every
from fulmar_ros.qos import subscriber_qos

MOST_ASKED = 3  # times that the plant asks again at the first step, which takes half a second each


class ReadingInputs:
    """Subscribes the readings that a controller takes, and nothing else.

    Attributes:
        newest: What came.
        followed: Subscriptions by topic.
        images: Those of the topics that carry images.
        subscribed: The wires; the values say whether a best-effort publisher is refused.
    """

    def __init__(
        self,
        node: Node,
        robot: Robot,
        names: Iterable[str],
        on_reading: Callable[[], None],
        *,
        frames: Frames,
        lockstep: bool,
    ) -> None:
        """Create the subscriptions.

        Args:
            node: Their owner.
            robot: The robot.
            names: As in `NewestReadings`.
            on_reading: Called after each message of a sensor.
            frames: Of the robot.
            lockstep: Whether a step waits for the readings of its time.

        Raises:
            ConfigError: As in `NewestReadings`.
        """
        self._frames, self._lockstep, self._on_reading = frames, lockstep, on_reading
        self._asked = 0
        self.newest = NewestReadings(robot, names, in_step=lockstep)
        self.followed: dict[str, list[Subscription]] = {}
        self.images = [kind.wire.name for kind in self.newest.kinds.values() if kind.image]
        self.subscribed = {
            kind.wire: lockstep and kind.comes_with_its_step for kind in self.newest.kinds.values()
        }
        for name, kind in self.newest.kinds.items():
            wire = kind.wire
            kind_of_message, receive = needed_class(wire), partial(self._take, name, reader_of(kind))
            if kind.image:
                qos = subscriber_qos(wire, reliable=lockstep)
                # As bytes: rclpy would copy their pixels one by one.
                receive = partial(self._take_bytes, name, reader_of(kind))
                made = node.create_subscription(kind_of_message, wire.name, receive, qos, raw=True)
                self.followed[wire.name] = [made]
            elif kind.sensor is None:
                self.followed[wire.name] = subscribe_every(node, kind_of_message, wire, receive)
            else:
                qos = subscriber_qos(wire, reliable=lockstep)
                self.followed[wire.name] = [
                    node.create_subscription(kind_of_message, wire.name, receive, qos)
                ]

    def destroy(self, node: Node) -> None:
        """Destroy the subscriptions."""
        destroy_all(node, self.followed.values())

    def lacks_something_of(self, time_ns: int) -> bool:
        """Whether a step of lock step waits for a reading of its time [ns]."""
        return self._lockstep and self.newest.lacks_something_of(time_ns)

    def lacks_the_first(self, *, again: bool) -> bool:
        """Whether a first step of lock step waits for a sensor that has said nothing; not for ever, one may be slow.

        Args:
            again: Whether the plant asks again.
        """
        self._asked += again
        return self._lockstep and self._asked < MOST_ASKED and bool(self.newest.silent)

    def _take(self, name: str, read: Read, message: Any) -> None:
        newest = self.newest
        try:
            reading = read(message, self._frames)
            if isinstance(reading, str):
                newest.refuse(name, reading)
            elif (
                newest.take(name, reading, stamp_ns(message.header.stamp))
                and newest.kinds[name].comes_with_its_step
            ):
                self._on_reading()
        except (ValueError, TypeError, KeyError, ArithmeticError) as error:
            newest.refuse(name, f"{name} cannot be read: {type(error).__name__}: {error}")

    def _take_bytes(self, name: str, read: Read, data: bytes) -> None:
        """Take a serialised image."""
        try:
            self._take(name, read, read_image(data))
        except ValueError as error:
            self.newest.refuse(name, str(error))
