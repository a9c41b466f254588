"""Trips and returns of the envelope guard, and their form as texts by name."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

BACKUP, NONE = "backup", "none"  # interventions


@dataclass(frozen=True)
class Event:
    """The guard took over, or gave back.

    Attributes:
        stamp_ns: Of the measurement, on the plant's clock [ns].
        tripped: Whether the backup takes over; else the controller acts again.
        cause: In words; empty where the controller acts again.
        room: That was left [m].
        trip: How many trips there were since the last goal, this one counted.
        refused: Command of the controller that was not sent, shape (m,).
        sent: Command that was, shape (m,).
        side: Bound that `room` is of; empty where there is none, or where it is not known.
    """

    stamp_ns: int
    tripped: bool
    cause: str
    room: float
    trip: int
    refused: tuple[float, ...]
    sent: tuple[float, ...]
    side: str = ""

    @property
    def words(self) -> str:
        """What happened, for people."""
        if not self.tripped:
            return "the envelope guard gives back: the controller acts again"
        return f"the envelope guard takes over, trip {self.trip}: {self.cause}"

    def as_texts(self) -> dict[str, str]:
        """Every part by its name; numbers are exact."""
        return {
            "stamp_ns": str(self.stamp_ns),
            "intervention": BACKUP if self.tripped else NONE,
            "cause": self.cause,
            "margin": repr(self.room),
            "trip": str(self.trip),
            "refused": json.dumps(self.refused),
            "sent": json.dumps(self.sent),
            "side": self.side,
        }


def event_of(texts: Mapping[str, str]) -> Event:
    """The event that `Event.as_texts` wrote.

    Raises:
        KeyError: A part is missing.
        ValueError: A part is no number.
    """
    return Event(
        int(texts["stamp_ns"]),
        texts["intervention"] == BACKUP,
        texts["cause"],
        float(texts["margin"]),
        int(texts["trip"]),
        tuple(map(float, json.loads(texts["refused"]))),
        tuple(map(float, json.loads(texts["sent"]))),
        texts.get("side", ""),
    )
