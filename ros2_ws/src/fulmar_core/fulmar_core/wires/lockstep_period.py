"""Readings of one control period of lock step, collected until all are there, and in one order. Knows no ROS.

The plant says how many messages each topic has in a period; so does each node whose outputs are inputs of another. A
period is complete when that many messages of different stamps are there. Then the readings are handed over by stamp and
name, whatever order they arrived in, so that one seed gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Generic, TypeVar

T = TypeVar("T")

MOST_MESSAGES = 1e6  # of a topic in a period
PLANT = ""  # stands for the plant among the sources


def counts_of(names: Iterable[str], values: Iterable[float]) -> dict[str, int]:
    """Numbers of messages by topic; values that are no counts are left out."""
    pairs = zip(names, values, strict=False)
    return {name: round(value) for name, value in pairs if 0.0 <= value <= MOST_MESSAGES}


class PeriodInbox(Generic[T]):
    """Collects the readings of one period after another. Not thread-safe.

    Attributes:
        answered_ns: Stamp of the period that was handed over last; -1 before the first [ns].
    """

    def __init__(self, topics: Mapping[str, str], *, upstream: Iterable[str] = ()) -> None:
        """Begin empty.

        Args:
            topics: Name of the reading by the topic on which it comes.
            upstream: Nodes other than the plant that publish some of these topics.
        """
        self._topics = dict(topics)
        self._sources = (PLANT, *upstream)
        self._items: dict[str, dict[int, T]] = {topic: {} for topic in topics}
        self._taken_ns = dict.fromkeys(topics, -1)
        self._expected: dict[str, tuple[int, dict[str, int]]] = {}
        self.answered_ns = -1

    def add(self, topic: str, stamp_ns: int, item: T) -> None:
        """Keep what came on a topic; a repetition of what is there or was handed over is left out."""
        if stamp_ns > self._taken_ns[topic]:
            self._items[topic].setdefault(stamp_ns, item)

    def expect(self, source: str, stamp_ns: int, counts: Mapping[str, int]) -> None:
        """Note how much a source has published on each topic in the period that ends at a stamp; of others nothing."""
        newest_ns, _ = self._expected.get(source, (-1, {}))
        if source in self._sources and stamp_ns >= newest_ns:
            self._expected[source] = stamp_ns, {name: n for name, n in counts.items() if name in self._topics}

    def take(self) -> tuple[int, list[tuple[str, T]]] | None:
        """Hand over the next period once it is complete: its stamp, and readings with their names by stamp, then name.

        Returns:
            None while something is missing.
        """
        if len(self._expected) < len(self._sources):
            return None
        (stamp_ns, *others) = {stamp for stamp, _ in self._expected.values()}
        if others or stamp_ns <= self.answered_ns:
            return None
        wanted = dict.fromkeys(self._topics, 0)
        for _, counts in self._expected.values():
            for topic, count in counts.items():
                wanted[topic] += count
        here = {topic: [s for s in items if s <= stamp_ns] for topic, items in self._items.items()}
        if any(len(here[topic]) < count for topic, count in wanted.items()):
            return None
        found = []
        for topic, stamps in here.items():
            found += [(stamp, self._topics[topic], self._items[topic].pop(stamp)) for stamp in stamps]
            self._taken_ns[topic] = max(stamps, default=self._taken_ns[topic])
        self.answered_ns = stamp_ns
        return stamp_ns, [(name, item) for _, name, item in sorted(found, key=lambda one: one[:2])]
