"""Links of emulated autopilots, in MAVLink 2 whatever else of the process has imported pymavlink before."""

from __future__ import annotations

import os
from typing import Any

os.environ.setdefault(
    "MAVLINK20", "1"
)  # pymavlink reads it when it is imported, and when it chooses a dialect

from pymavlink import mavutil

DIALECT = "ardupilotmega"


class Intervals:
    """When each message is due that a ground station has asked for at an interval."""

    def __init__(self) -> None:
        """Begin with none."""
        self._period_s: dict[int, float] = {}
        self._due_s: dict[int, float] = {}

    def ask(self, kind: int, period_s: float, now_s: float) -> None:
        """Send messages of a kind from now on, one a period [s]."""
        self._period_s[kind], self._due_s[kind] = period_s, now_s

    def period_s(self, kind: int, otherwise: float) -> float:
        """Time between two messages of a kind, or another where none was asked for [s]."""
        return self._period_s.get(kind, otherwise)

    def is_due(self, kind: int, now_s: float) -> bool:
        """Whether one is to be sent now; it then counts as sent."""
        period_s = self._period_s.get(kind)
        if period_s is None or now_s < self._due_s[kind]:
            return False
        self._due_s[kind] = max(self._due_s[kind] + period_s, now_s + 0.5 * period_s)
        return True


def link_to(port: int) -> tuple[Any, str]:
    """A link of system 1 that speaks first, to a UDP port of this host, and the address at which that receives it."""
    os.environ["MAVLINK20"] = "1"
    link = mavutil.mavlink_connection(
        f"udpout:127.0.0.1:{port}", source_system=1, source_component=1, robust_parsing=True, dialect=DIALECT
    )
    return link, f"udpin:127.0.0.1:{port}"
