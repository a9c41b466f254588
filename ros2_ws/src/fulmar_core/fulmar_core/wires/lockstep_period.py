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

    def __init__(
        self, topics: Mapping[str, str], *, upstream: Iterable[str] = (), silent: Iterable[str] = ()
    ) -> None:
        """Begin empty.

        Args:
            topics: Name of the reading by the topic on which it comes.
            upstream: Nodes other than the plant that publish some of these topics.
            silent: Topics that no node of the chain publishes, such as those of sensors that the robot lacks.
        """
        self._topics = dict(topics)
        self._sources = (PLANT, *upstream)
        self._items: dict[str, dict[int, T]] = {topic: {} for topic in topics}
        self._taken_ns = dict.fromkeys(topics, -1)
        self._newest_ns = {topic: -1 for topic in topics if topic not in set(silent)}
        # Of the period under way, by topic: stamps of what `ready` has handed over.
        self._early: dict[str, set[int]] = {topic: set() for topic in topics}
        self._expected: dict[str, tuple[int, dict[str, int]]] = {}
        self.answered_ns = -1

    def add(self, topic: str, stamp_ns: int, item: T) -> None:
        """Keep what came on a topic; a repetition of what is there or was handed over is left out."""
        if stamp_ns > self._taken_ns[topic] and stamp_ns not in self._early[topic]:
            self._items[topic].setdefault(stamp_ns, item)
            self._newest_ns[topic] = max(self._newest_ns.get(topic, stamp_ns), stamp_ns)

    def ready(self) -> list[tuple[str, T]]:
        """Hand over what belongs first into the period under way, before the period is complete; ordered as by `take`.

        The messages of a topic arrive in order, so nothing comes any more that is older than the newest of each topic.
        That holds from the first answer on: the first messages can get lost while endpoints still find each other.
        Outputs of other nodes come when they will.
        """
        if self.answered_ns < 0 or len(self._sources) > 1:
            return []
        until_ns = min(self._newest_ns.values(), default=-1)
        if until_ns <= self.answered_ns:
            return []
        found = []
        for topic, items in self._items.items():
            for stamp in [stamp for stamp in items if stamp <= until_ns]:
                found.append((stamp, self._topics[topic], items.pop(stamp)))
                self._early[topic].add(stamp)
        return _in_order(found)

    def expect(self, source: str, stamp_ns: int, counts: Mapping[str, int]) -> None:
        """Note how much a source has published on each topic in the period that ends at a stamp; of others nothing."""
        newest_ns, _ = self._expected.get(source, (-1, {}))
        if source in self._sources and stamp_ns >= newest_ns:
            self._expected[source] = stamp_ns, {name: n for name, n in counts.items() if name in self._topics}

    @property
    def is_asked(self) -> bool:
        """Whether the end of a period was announced that was not handed over; cheaper than `take`."""
        return any(stamp_ns > self.answered_ns for stamp_ns, _ in self._expected.values())

    def take(self) -> tuple[int, list[tuple[str, T]]] | None:
        """Hand over the next period once it is complete: its stamp, and readings with their names by stamp, then name.

        Returns:
            None while something is missing. What `ready` has handed over does not come again.
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
        early = {topic: {s for s in stamps if s <= stamp_ns} for topic, stamps in self._early.items()}
        if any(len(here[topic]) + len(early[topic]) < count for topic, count in wanted.items()):
            return None
        found = []
        for topic, stamps in here.items():
            found += [(stamp, self._topics[topic], self._items[topic].pop(stamp)) for stamp in stamps]
            self._taken_ns[topic] = max(*stamps, *self._early[topic], self._taken_ns[topic], -1)
            self._early[topic] -= early[topic]
        self.answered_ns = stamp_ns
        return stamp_ns, _in_order(found)


def _in_order(found: list[tuple[int, str, T]]) -> list[tuple[str, T]]:
    """Names and items by stamp, then name."""
    return [(name, item) for _, name, item in sorted(found, key=lambda one: one[:2])]
