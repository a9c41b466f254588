"""Which recorded messages say that something went wrong. Knows no rclpy."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from fulmar_bags.message_types import type_store
from fulmar_core.topics import DIAGNOSTICS, ESTOP, STATUS, Wire

ERROR, STALE = 2, 3  # levels of diagnostic_msgs/DiagnosticStatus
RECORDER = "recorder"


def fault_finder(robot: str, topics: Mapping[Wire, str]) -> Callable[[str, bytes], str]:
    """Look for a robot's faults: an error of its plant (the watchdog's among them) or its controller, an e-stop.

    Args:
        robot: Name of the robot; other robots' errors on `/diagnostics` are none of its own.
        topics: Absolute name of each wire.

    Returns:
        A function of topic and CDR data that gives the fault in words, or an empty text.
    """
    watched = {topics[wire]: wire for wire in (STATUS, DIAGNOSTICS, ESTOP)}

    def fault_in(topic: str, data: bytes) -> str:
        wire = watched.get(topic)
        if wire is None:
            return ""
        try:
            message = type_store().deserialize_cdr(data, wire.type)
        except Exception:  # noqa: BLE001 - foreign bytes raise whatever they please; they are kept, and no fault
            return ""
        return _of_estop(message) if wire is ESTOP else _of_diagnostics(robot, message)

    return fault_in


def _of_estop(message: Any) -> str:
    return "e-stop" if message.data else ""


def _of_diagnostics(robot: str, message: Any) -> str:
    for status in message.status:
        name, _, part = status.name.partition(": ")
        if name == robot and part != RECORDER and status.level in (ERROR, STALE):
            return f"{part}: {status.message}"
    return ""
