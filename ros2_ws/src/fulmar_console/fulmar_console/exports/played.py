"""The robots of a recording, with their columns by name."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_console.bags.recording import Recording
from fulmar_console.bags.track import POSE

SHARE = "share:"
SMALLEST_GOAL_M = 0.02  # that is drawn where a task has no tolerance of a place [m]


@dataclass(frozen=True)
class Played:
    """One robot of a recording."""

    index: int
    record: dict[str, Any]
    fields: tuple[str, ...]
    table: np.ndarray  # (n, fields), float32
    changes: list[list[Any]]  # time and health, as in `Recording`
    targets: list[list[list[float]]]

    @property
    def name(self) -> str:
        """What it is called."""
        return str(self.record["name"])

    @property
    def shares(self) -> tuple[str, ...]:
        """Names of the columns of actuators."""
        return tuple(field for field in self.fields if field.startswith(SHARE))

    @property
    def poses(self) -> np.ndarray:
        """x, y, z [m] and quaternion x, y, z, w, shape (n, 7)."""
        first = self.fields.index(POSE[0])
        return self.table[:, first : first + len(POSE)]

    @property
    def tolerance_m(self) -> float:
        """How near to a goal is at it [m]."""
        said = ((self.record.get("info") or {}).get("tolerance") or {}).get("position_m", 0.0)
        return max(float(said), SMALLEST_GOAL_M)

    def column(self, field: str) -> np.ndarray:
        """A column by its name, shape (n,), as float64."""
        return self.table[:, self.fields.index(field)].astype(float)

    def goals(self) -> Iterator[tuple[float, list[float]]]:
        """Time and pose of each target that counts from then on; velocities have no place."""
        before: list[float] | None = None
        for t_s, health in self.changes:
            goal = health.get("goal") or {}
            if "targets" not in goal:
                continue
            targets = self.targets[goal["targets"]]
            target = targets[goal.get("done", 0) % len(targets)]
            if target != before and len(target) == len(POSE):
                before = target
                yield t_s, target


def played_robots(recording: Recording) -> list[Played]:
    """The robots of a recording, in their order."""
    document = recording.document
    numbers = np.frombuffer(recording.columns, dtype="<f4")
    found = []
    for record, track, health in zip(document["robots"], document["tracks"], document["health"], strict=True):
        width, begin = len(track["fields"]), track["offset"]
        table = numbers[begin : begin + width * track["count"]].reshape(track["count"], width)
        fields = tuple(track["fields"])
        found.append(Played(track["index"], record, fields, table, health["changes"], health["targets"]))
    return found
