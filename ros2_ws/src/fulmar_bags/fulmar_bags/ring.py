"""Ring buffer of messages that writes a bag when a fault occurs; and which messages are faults. Knows no rclpy.

Each fault gives a file of the bag: what came before it, and what came for a while after. Latched messages that are
older than the memory, such as the goal, come first in it, at the time where it begins, as a late subscriber would get
them. While the disk refuses the file, all that comes waits in memory.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from fulmar_bags.message_types import type_store
from fulmar_bags.writer import BagCounts, BagWriter
from fulmar_core.robots.topics import DIAGNOSTICS, ESTOP, STATUS, Wire

FAULTS = "fulmar_faults"  # entry of `custom_data`: JSON list of when and why
MAX_BYTES = 64 << 20  # of memory
RETRY_S = 0.5  # between two tries to begin a file
NS = 1_000_000_000
ERROR, STALE = 2, 3  # levels of diagnostic_msgs/DiagnosticStatus
RECORDER = "recorder"  # name of its diagnostics, which are no fault of the robot


@dataclass(frozen=True, slots=True)
class _Message:
    topic: str
    data: bytes
    log_ns: int
    publish_ns: int | None


class BagRing:
    """Receives messages as a `BagWriter` does; most of them never reach a disk."""

    def __init__(
        self,
        open_bag: Callable[[], BagWriter],
        *,
        before_s: float,
        after_s: float,
        latched: Mapping[str, int],
        fault_in: Callable[[str, bytes], str],
        max_bytes: int = MAX_BYTES,
        faults: Sequence[dict[str, object]] = (),
    ) -> None:
        """Begin with an empty memory.

        Args:
            open_bag: Makes the bag, with its topics; called at the first fault, and again where it fails.
            before_s: How much is kept [s].
            after_s: How long writing goes on after the last sign of a fault [s].
            latched: Latched topics, and how many messages of each are kept however old they are.
            fault_in: Fault that a message reports, by topic and data; empty if none.
            max_bytes: More is not kept; then less than `before_s` is.
            faults: Those that an interrupted bag, which goes on, has files of.
        """
        self._open_bag, self._fault_in = open_bag, fault_in
        self._before_ns, self._after_ns, self._max_bytes = (
            round(before_s * NS),
            round(after_s * NS),
            max_bytes,
        )
        self._kept: deque[_Message] = deque()
        self._bytes = 0
        self._held: dict[str, deque[_Message]] = {name: deque(maxlen=n) for name, n in latched.items()}
        self._attachments: dict[str, bytes] = {}
        self._until_ns = -1  # the last sign of a fault and what follows it [ns]
        self._due = False  # whether a fault has no file yet
        self._bytes_due = 0  # that came since it showed
        self._next_try = 0.0
        self._bag: BagWriter | None = None
        self.faults: list[dict[str, object]] = list(faults)  # that showed so far
        self.cut_short = False  # whether the memory was too small for `before_s`

    @property
    def kept_s(self) -> float:
        """Time that the memory goes back [s]."""
        return (self._kept[-1].log_ns - self._kept[0].log_ns) / NS if self._kept else 0.0

    @property
    def counts(self) -> BagCounts:
        """Of the bag, and of messages that belong to a fault whose file has not begun."""
        counts = self._bag.counts if self._bag else BagCounts()
        return replace(counts, messages=counts.messages + (len(self._kept) if self._due else 0))

    @property
    def waiting(self) -> int:
        """Bytes that the disk has not taken yet, without those from before a fault."""
        return (self._bag.waiting if self._bag else 0) + self._bytes_due

    def write(self, topic: str, data: bytes, *, log_ns: int, publish_ns: int | None = None) -> None:
        """As `BagWriter.write`; messages of a fault stay in memory until `tick` has begun its file."""
        message = _Message(topic, data, log_ns, publish_ns)
        reason = self._fault_in(topic, data)
        if reason:
            self._note_fault(reason, log_ns)
        if self._bag is not None and not self._due and log_ns <= self._until_ns:
            self._bag.write(topic, data, log_ns=log_ns, publish_ns=publish_ns)
            self._hold(message)
        else:
            self._keep(message)

    def attach(self, name: str, data: bytes) -> None:
        """As `BagWriter.attach`; it waits while there is no bag."""
        self._attachments[name] = data
        if self._bag is not None:
            self._bag.attach(name, data)

    def note(self, name: str, text: str) -> None:
        """As `BagWriter.note`; nothing while there is no bag."""
        if self._bag is not None:
            self._bag.note(name, text)

    def tick(self, now: float) -> None:
        """As `BagWriter.tick`; begins the file of a fault, if the disk lets it.

        Raises:
            BagError: The disk lets no bag begin; what waits is tried again later.
            OSError: As `BagWriter.tick`.
        """
        if self._due and now >= self._next_try:
            self._next_try = now + RETRY_S
            self._begin()
        if self._bag is not None:
            self._bag.tick(now)

    def close(self) -> None:
        """As `BagWriter.close`.

        Raises:
            BagError: As `tick`; then what waits is lost.
            OSError: As `BagWriter.close`.
        """
        try:
            if self._due:
                self._begin()
        finally:
            if self._bag is not None:
                self._bag.close()

    def _note_fault(self, reason: str, log_ns: int) -> None:
        if log_ns > self._until_ns:
            self.faults.append({"time_ns": log_ns, "reason": reason})
            if not self._due:
                self._forget_before(log_ns - self._before_ns)
                self._due = True
        self._until_ns = log_ns + self._after_ns

    def _begin(self) -> None:
        """Begin a file and write what is kept."""
        if self._bag is None:
            self._bag = self._open_bag()
            for name, data in self._attachments.items():
                self._bag.attach(name, data)
        else:
            self._bag.split()
        self._due, self._bytes_due = False, 0
        self._bag.note(FAULTS, json.dumps(self.faults))
        first_ns = self._kept[0].log_ns
        for message in (message for held in self._held.values() for message in held):
            sent_ns = message.publish_ns or message.log_ns
            self._bag.write(message.topic, message.data, log_ns=first_ns, publish_ns=sent_ns)
        for message in self._kept:
            self._bag.write(message.topic, message.data, log_ns=message.log_ns, publish_ns=message.publish_ns)
            self._hold(message)
        self._kept.clear()
        self._bytes = 0

    def _keep(self, message: _Message) -> None:
        self._kept.append(message)
        self._bytes += len(message.data)
        if self._due:
            self._bytes_due += len(message.data)
            return
        self._forget_before(message.log_ns - self._before_ns)
        while self._bytes > self._max_bytes:
            self.cut_short = True
            self._forget_first()

    def _forget_before(self, time_ns: int) -> None:
        while self._kept and self._kept[0].log_ns < time_ns:
            self._forget_first()

    def _forget_first(self) -> None:
        message = self._kept.popleft()
        self._bytes -= len(message.data)
        self._hold(message)

    def _hold(self, message: _Message) -> None:
        if message.topic in self._held:
            self._held[message.topic].append(message)


def fault_finder(robot: str, topics: Mapping[Wire, str]) -> Callable[[str, bytes], str]:
    """A function that finds faults of a robot: errors of its plant (a watchdog trip, too) or controller, an e-stop.

    Args:
        robot: Name of the robot; `/diagnostics` has those of others, too.
        topics: Absolute name of each wire.

    Returns:
        Gives the fault in words by topic and CDR data, or an empty text.
    """
    watched = {topics[wire]: wire for wire in (STATUS, DIAGNOSTICS, ESTOP)}

    def fault_in(topic: str, data: bytes) -> str:
        wire = watched.get(topic)
        if wire is None:
            return ""
        try:
            message: Any = type_store().deserialize_cdr(data, wire.type)
        except Exception:  # noqa: BLE001 - foreign bytes raise whatever they please; they are kept, and no fault
            return ""
        if wire is ESTOP:
            return "e-stop" if message.data else ""
        return _of_diagnostics(robot, message)

    return fault_in


def _of_diagnostics(robot: str, message: Any) -> str:
    for status in message.status:
        name, _, part = status.name.partition(": ")
        if name == robot and part != RECORDER and status.level in (ERROR, STALE):
            return f"{part}: {status.message}"
    return ""
