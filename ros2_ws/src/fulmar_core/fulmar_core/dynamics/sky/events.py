"""Events of an event camera: brightness changes of single pixels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class Events:
    """Events of one camera in the order of time."""

    x: np.ndarray  # column, uint16, shape (n,) [px]
    y: np.ndarray  # row, uint16, shape (n,) [px]
    t: np.ndarray  # when, uint64, shape (n,) [ns]
    p: np.ndarray  # 1 for brighter, 0 for darker, uint8, shape (n,)
    width: int  # of the array [px]
    height: int  # [px]

    def __len__(self) -> int:
        return len(self.t)

    def between(self, begin_ns: int, end_ns: int) -> Events:
        """Those from a time on and before another one [ns]."""
        first, last = np.searchsorted(self.t, np.array([max(begin_ns, 0), max(end_ns, 0)], dtype=np.uint64))
        return self[first:last]

    def __getitem__(self, index: slice | np.ndarray) -> Events:
        """Some of them."""
        return Events(self.x[index], self.y[index], self.t[index], self.p[index], self.width, self.height)

    def problem(self) -> str:
        """Why they cannot be events of such an array; empty if they can."""
        if len({len(self.x), len(self.y), len(self.t), len(self.p)}) != 1:
            return "x, y, t and p differ in length"
        if not len(self):
            return ""
        if int(self.x.max()) >= self.width or int(self.y.max()) >= self.height:
            x, y = int(self.x.max()), int(self.y.max())
            return f"events up to ({x}, {y}) are of a camera of another size than {self.width} × {self.height} pixels"
        if int(self.p.max()) > 1:
            return f"polarities up to {int(self.p.max())}, must be 1 for brighter, 0 or -1 for darker"
        if (self.t[1:] < self.t[:-1]).any():
            return "events are not in the order of time"
        return ""


def as_polarities(p: np.ndarray) -> np.ndarray:
    """Polarities with 0 for darker where a source says -1, in integers of any kind; all others stay as they are."""
    darker = -1 if p.dtype.kind != "u" else np.iinfo(p.dtype).max
    return np.asarray(np.where(p == darker, 0, p))


def no_events(width: int, height: int) -> Events:
    """An empty packet."""
    return events_of(np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0), width, height)


def events_of(
    x: np.ndarray, y: np.ndarray, t_ns: np.ndarray, p: np.ndarray, width: int, height: int
) -> Events:
    """Events from arrays of any type, sorted by time."""
    order = np.argsort(t_ns, kind="stable")
    return Events(
        x[order].astype(np.uint16), y[order].astype(np.uint16), t_ns[order].astype(np.uint64),
        p[order].astype(np.uint8), width, height,
    )  # fmt: skip


def joined(packets: Sequence[Events]) -> Events:
    """Packets of one camera, at least one, as one; sorted by time."""
    first = packets[0]
    x, y, t, p = (np.concatenate([getattr(packet, name) for packet in packets]) for name in "xytp")
    return events_of(x, y, t, p, first.width, first.height)
