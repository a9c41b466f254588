"""One bag for each goal: the next goal ends a bag and begins another one. Knows no rclpy.

Every bag begins with the newest latched messages, its goal among them, as a late subscriber would get them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Set
from dataclasses import replace

from fulmar_bags.writer import BagCounts, BagWriter

RETRY_S = 0.5  # between two tries to begin a bag


class BagPerGoal:
    """Takes messages as a `BagWriter` does.

    Where the disk refuses a new bag, recording goes on in the one before until it does not.
    """

    def __init__(
        self,
        open_bag: Callable[[int], BagWriter],
        *,
        goals: Set[str],
        latched: Mapping[str, int],
        first: int = 1,
    ) -> None:
        """Begin with the bag of the first goal.

        Args:
            open_bag: Makes the bag of a number, from 1, with its topics.
            goals: Topics of goals.
            latched: Latched topics, and how many messages of each a bag begins with.
            first: Number of the first bag.

        Raises:
            BagError: The first bag cannot be written.
        """
        self._open_bag, self._goals = open_bag, goals
        self._held: dict[str, deque[tuple[bytes, int, int]]] = {
            name: deque(maxlen=n) for name, n in latched.items()
        }
        self._attachments: dict[str, bytes] = {}
        self._goal: bytes | None = None  # the newest
        self._due = False  # whether a goal has no bag yet
        self._next_try = 0.0
        self._repeated = 0  # latched messages that bags begin with
        self._first = first
        self._bags = [open_bag(first)]
        self._unclosed: list[BagWriter] = []

    @property
    def counts(self) -> BagCounts:
        """Of all bags, without the latched messages that a bag repeats at its beginning."""
        total = sum((bag.counts for bag in self._bags), BagCounts())
        on_disk = max(0, total.on_disk - self._repeated)
        return replace(total, messages=total.messages - self._repeated, on_disk=on_disk)

    @property
    def waiting(self) -> int:
        """Bytes that the disk has not taken yet."""
        return sum(bag.waiting for bag in self._bags)

    def write(self, topic: str, data: bytes, *, log_ns: int, publish_ns: int | None = None) -> None:
        """As `BagWriter.write`; a new goal gets its bag with the next `tick`."""
        self._bags[-1].write(topic, data, log_ns=log_ns, publish_ns=publish_ns)
        if topic in self._held:
            self._held[topic].append((data, log_ns, publish_ns or log_ns))
        if topic in self._goals and data != self._goal:
            self._due, self._goal = self._goal is not None, data

    def attach(self, name: str, data: bytes) -> None:
        """As `BagWriter.attach`, for this bag and all that follow."""
        self._attachments[name] = data
        self._bags[-1].attach(name, data)

    def note(self, name: str, text: str) -> None:
        """As `BagWriter.note`."""
        self._bags[-1].note(name, text)

    def tick(self, now: float) -> None:
        """As `BagWriter.tick`; begins the bag of a new goal.

        Raises:
            BagError: The disk lets no bag begin; it is tried again later.
            OSError: As `BagWriter.tick`.
        """
        if self._due and now >= self._next_try:
            self._next_try = now + RETRY_S
            self._begin()
        self._close_old()
        self._bags[-1].tick(now)

    def close(self) -> None:
        """As `BagWriter.close`, also where the disk refuses to close an earlier one."""
        try:
            self._close_old()
        finally:
            self._bags[-1].close()

    def _close_old(self) -> None:
        """Close the bags of earlier goals; one that the disk refuses is tried again."""
        while self._unclosed:
            self._unclosed[-1].close()
            self._unclosed.pop()

    def _begin(self) -> None:
        new = self._open_bag(self._first + len(self._bags))
        self._unclosed.append(self._bags[-1])
        self._bags.append(new)
        self._due = False
        for name, data in self._attachments.items():
            new.attach(name, data)
        messages = [(topic, *message) for topic, held in self._held.items() for message in held]
        first_ns = max((log_ns for _, _, log_ns, _ in messages), default=0)
        for topic, data, _, sent_ns in messages:
            new.write(topic, data, log_ns=first_ns, publish_ns=sent_ns)
        self._repeated += len(messages)
