"""Raw frames of cameras as a bag keeps them: packed, in the recorder's own thread. Knows no rclpy.

A frame of 320 × 240 takes 0.3 to 2 ms to pack. The recorder does it, at its low priority, and not the camera, which
answers every period of lock step; so cameras of others, which publish raw frames alone, are kept small, too.
"""

from __future__ import annotations

from collections.abc import Callable, Collection

from fulmar_bags.frame_messages import packed
from fulmar_bags.writer import BagCounts
from fulmar_bags.writer_thread import Bag
from fulmar_core.config.errors import BagError


class PackedFrames:
    """Takes messages as a `BagWriter` does, and gives another bag those with raw frames packed."""

    def __init__(self, bag: Bag, topics: Collection[str], on_error: Callable[[str], None]) -> None:
        """Begin.

        Args:
            bag: It knows the topics, and those with an ending for packed frames.
            topics: Names of those with raw frames.
            on_error: Receives one line for each topic whose frames cannot be packed, which stay raw.
        """
        self._bag, self._topics, self._on_error = bag, frozenset(topics), on_error
        self._refused: set[str] = set()
        self._brought: set[str] = set()  # packed topics that their camera publishes itself

    @property
    def counts(self) -> BagCounts:
        """As of the other bag."""
        return self._bag.counts

    @property
    def waiting(self) -> int:
        """As of the other bag [bytes]."""
        return self._bag.waiting

    def write(self, topic: str, data: bytes, *, log_ns: int, publish_ns: int | None = None) -> None:
        """As `BagWriter.write`."""
        if topic not in self._topics:
            raw = topic.rpartition("/")[0]
            self._brought |= {topic} if raw in self._topics else set()
            self._bag.write(topic, data, log_ns=log_ns, publish_ns=publish_ns)
            return
        for name, message in self._packed(topic, data):
            if name not in self._brought:
                self._bag.write(name, message, log_ns=log_ns, publish_ns=publish_ns)

    def _packed(self, topic: str, data: bytes) -> list[tuple[str, bytes]]:
        try:
            return packed(data, topic)
        except Exception as error:  # noqa: BLE001 - a codec raises what it pleases, as of a frame too wide for it
            if topic not in self._refused:
                self._refused.add(topic)
                self._on_error(f"{_words(topic, error)} Its frames stay as they are.")
            return [(topic, data)]

    def attach(self, name: str, data: bytes) -> None:
        """As `BagWriter.attach`."""
        self._bag.attach(name, data)

    def note(self, name: str, text: str) -> None:
        """As `BagWriter.note`."""
        self._bag.note(name, text)

    def tick(self, now: float) -> None:
        """As `BagWriter.tick`."""
        self._bag.tick(now)

    def close(self) -> None:
        """As `BagWriter.close`."""
        self._bag.close()


def _words(topic: str, error: Exception) -> str:
    """One line about a frame that cannot be packed."""
    if isinstance(error, BagError):
        return str(error)
    return f"{topic}: a frame cannot be packed: {type(error).__name__}: {' '.join(str(error).split())}."
