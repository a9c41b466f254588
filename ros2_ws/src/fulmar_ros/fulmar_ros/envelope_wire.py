"""Publishes each trip and each return of the envelope guard."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from fulmar_core.robots.topics import ENVELOPE_STATE
from fulmar_core.safety.envelope.event import Event
from fulmar_core.safety.envelope.guard import EnvelopeGuard
from fulmar_ros.convert import stamp_of
from fulmar_ros.qos import publisher_qos

RETURNED = "the controller acts again"


class EnvelopeWire:
    """Publisher of `envelope/state`."""

    def __init__(self, node: Node, name: str, guard: EnvelopeGuard) -> None:
        """Publish what a guard does from now on, under the robot's name."""
        self._node, self._name, self._guard = node, f"{name}: envelope", guard
        self._publisher = node.create_publisher(
            DiagnosticArray, ENVELOPE_STATE.name, publisher_qos(ENVELOPE_STATE)
        )
        self._published = 0

    def publish(self) -> None:
        """Publish the events since the last call; trips are logged, too."""
        new = self._guard.events[self._published :]
        self._published += len(new)
        for event in new:
            self._publisher.publish(self._message(event))
            if event.tripped:
                self._node.get_logger().warning(f"the envelope guard takes over: {event.cause}")

    def destroy(self) -> None:
        """Destroy the publisher."""
        self._node.destroy_publisher(self._publisher)

    def _message(self, event: Event) -> DiagnosticArray:
        level = DiagnosticStatus.WARN if event.tripped else DiagnosticStatus.OK
        status = DiagnosticStatus(level=level, name=self._name, message=event.cause or RETURNED)
        status.values = [KeyValue(key=key, value=value) for key, value in event.as_texts().items()]
        array = DiagnosticArray(status=[status])
        array.header.stamp = stamp_of(event.stamp_ns)
        return array
