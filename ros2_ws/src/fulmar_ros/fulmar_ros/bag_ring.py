"""Keeps the newest messages in memory, and begins to write when told of a fault. Knows no rclpy.

Each fault gives a file of the bag: what came before it, and what came for a while after. Latched messages that are
older than the memory, such as the goal, come first in it, at the time where it begins, as a late subscriber would get
them.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from fulmar_ros.bag_writer import BagWriter

FAULTS = "fulmar_faults"  # entry of `custom_data`: JSON list of when and why
MAX_BYTES = 64 << 20  # of memory
NS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class _Message:
    topic: str
    data: bytes
    log_ns: int


class BagRing:
    """Takes messages as a `BagWriter` does; most of them never reach a disk."""

    def __init__(
        self,
        open_bag: Callable[[], BagWriter],
        *,
        before_s: float,
        after_s: float,
        latched: Mapping[str, int],
        fault_in: Callable[[str, bytes], str],
        max_bytes: int = MAX_BYTES,
    ) -> None:
        """Begin with an empty memory.

        Args:
            open_bag: Makes the bag, with its topics; called at the first fault.
            before_s: How much is kept [s].
            after_s: How long writing goes on after the last sign of a fault [s].
            latched: Topics whose newest messages hold on however old they are, and how many of each.
            fault_in: What fault a message tells of, by topic and data; empty if none.
            max_bytes: More is not kept; then less than `before_s` is.
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
        self._writing_until_ns: int | None = None
        self._bag: BagWriter | None = None
        self.faults: list[dict[str, object]] = []
        self.cut_short = False  # whether the memory was too small for `before_s`

    @property
    def kept_s(self) -> float:
        """Time that the memory goes back [s]."""
        return (self._kept[-1].log_ns - self._kept[0].log_ns) / NS if self._kept else 0.0

    @property
    def messages(self) -> int:
        """Messages given to the bag so far."""
        return self._bag.messages if self._bag else 0

    @property
    def messages_on_disk(self) -> int:
        """Messages that a reader of the bag finds now."""
        return self._bag.messages_on_disk if self._bag else 0

    @property
    def files(self) -> int:
        """MCAP files of the bag so far."""
        return self._bag.files if self._bag else 0

    @property
    def size(self) -> int:
        """Bytes on disk."""
        return self._bag.size if self._bag else 0

    @property
    def waiting(self) -> int:
        """Bytes that the disk has not taken yet."""
        return self._bag.waiting if self._bag else 0

    def write(self, topic: str, data: bytes, *, log_ns: int) -> None:
        """Take a message; arguments as of `BagWriter.write`.

        Raises:
            BagError: It tells of a fault, and no bag can be begun.
        """
        if self._writing_until_ns is not None and log_ns > self._writing_until_ns:
            self._writing_until_ns = None
        reason = self._fault_in(topic, data)
        if reason:
            self._begin(reason, log_ns)
        if self._writing_until_ns is not None and self._bag is not None:
            self._bag.write(topic, data, log_ns=log_ns)
            self._hold(_Message(topic, data, log_ns))
        else:
            self._keep(_Message(topic, data, log_ns))

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
        """As `BagWriter.tick`.

        Raises:
            OSError: As `BagWriter.tick`.
        """
        if self._bag is not None:
            self._bag.tick(now)

    def close(self) -> None:
        """As `BagWriter.close`.

        Raises:
            OSError: As `BagWriter.close`.
        """
        if self._bag is not None:
            self._bag.close()

    def _begin(self, reason: str, log_ns: int) -> None:
        """Write what is kept, unless writing goes on already."""
        began, self._writing_until_ns = self._writing_until_ns is None, log_ns + self._after_ns
        if not began:
            return
        if self._bag is None:
            self._bag = self._open_bag()
            for name, data in self._attachments.items():
                self._bag.attach(name, data)
        else:
            self._bag.split()
        self.faults.append({"time_ns": log_ns, "reason": reason})
        self._bag.note(FAULTS, json.dumps(self.faults))
        self._forget_before(log_ns - self._before_ns)
        first_ns = self._kept[0].log_ns if self._kept else log_ns
        for message in (message for held in self._held.values() for message in held):
            self._bag.write(message.topic, message.data, log_ns=first_ns, publish_ns=message.log_ns)
        for message in self._kept:
            self._bag.write(message.topic, message.data, log_ns=message.log_ns)
            self._hold(message)
        self._kept.clear()
        self._bytes = 0

    def _keep(self, message: _Message) -> None:
        self._kept.append(message)
        self._bytes += len(message.data)
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
