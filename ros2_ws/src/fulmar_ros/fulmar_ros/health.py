"""Diagnostics: one named status, published on change and at a steady beat."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from rclpy.publisher import Publisher

from fulmar_core.robots.topics import DIAGNOSTICS
from fulmar_core.robots.wire_check import BETWEEN, WARNINGS
from fulmar_ros.convert import stamp_of
from fulmar_ros.launcher_watch import LauncherWatch
from fulmar_ros.qos import publisher_qos

LEVELS = {"ok": DiagnosticStatus.OK, "warn": DiagnosticStatus.WARN, "error": DiagnosticStatus.ERROR}


class Health:
    """Publishes the status of one part of the system."""

    def __init__(self, node: Node, name: str, *more: Publisher) -> None:
        """Publish on `/diagnostics` under a name such as `<robot>: plant`, and with more publishers of its type."""
        own = node.create_publisher(DiagnosticArray, DIAGNOSTICS.name, publisher_qos(DIAGNOSTICS))
        self._name, self.publishers = name, [*more, own]
        self._launcher = LauncherWatch()

    def listeners(self) -> int:
        """How many subscribers are matched: one that comes between two beats need not wait for the next."""
        return int(self.publishers[-1].get_subscription_count())

    def publish(
        self, level: str, message: str, values: Mapping[str, str], *, warnings: Sequence[str] = ()
    ) -> None:
        """Publish one status.

        Args:
            level: `ok`, `warn` or `error`.
            message: For people.
            values: For programs.
            warnings: What endangers the robot, one sentence each; the result and the report of a run list them. A
                launcher that is stopped is one more.
        """
        alone = self._launcher.problem()
        if alone:
            warnings = (*warnings, alone)
            level, message = ("warn", alone) if level == "ok" else (level, message)
        status = DiagnosticStatus(level=LEVELS[level], name=self._name, message=message, hardware_id="")
        status.values = [KeyValue(key=key, value=value) for key, value in values.items()]
        if warnings:
            status.values.append(KeyValue(key=WARNINGS, value=BETWEEN.join(warnings)))
        array = DiagnosticArray(status=[status])
        array.header.stamp = stamp_of(time.time_ns())
        for publisher in self.publishers:
            publisher.publish(array)
