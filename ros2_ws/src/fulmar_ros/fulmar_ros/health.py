"""Diagnostics: one named status, published on change and at a steady beat."""

from __future__ import annotations

import time
from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.publisher import Publisher

from fulmar_ros.convert import stamp_of

LEVELS = {"ok": DiagnosticStatus.OK, "warn": DiagnosticStatus.WARN, "error": DiagnosticStatus.ERROR}


class Health:
    """Publishes the status of one part of the system."""

    def __init__(self, name: str, publishers: list[Publisher]) -> None:
        """Publish under a name.

        Args:
            name: `<robot>: plant` or the like.
            publishers: Of DiagnosticArray.
        """
        self._name, self._publishers = name, publishers

    def publish(self, level: str, message: str, values: Mapping[str, str]) -> None:
        """Publish one status.

        Args:
            level: `ok`, `warn` or `error`.
            message: For people.
            values: For programs.
        """
        status = DiagnosticStatus(level=LEVELS[level], name=self._name, message=message, hardware_id="")
        status.values = [KeyValue(key=key, value=value) for key, value in values.items()]
        array = DiagnosticArray(status=[status])
        array.header.stamp = stamp_of(time.time_ns())
        for publisher in self._publishers:
            publisher.publish(array)
