"""Which topics of a bag are read, where not all of them are needed, and how far reading has come."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from mcap.records import Channel, Schema


def _every(_topic: str, _kind: str) -> bool:
    return True


def _silent(_share: float) -> None:
    pass


@dataclass
class Selection:
    """Which topics are read; messages of others are skipped before they are unpacked, which is most of the work.

    Attributes:
        wanted: Whether a topic is read, by its name and its type.
        checks: Whether each message is compared with its type, and those that do not fit are counted; who decodes all
            of them need not.
        kept: Types whose messages stay in memory whatever their number, which is twice as fast.
        progress: Takes the share of the bytes that are read, 0 to 1.
        skipped: Channels of the file that is being read whose messages are left out.
    """

    wanted: Callable[[str, str], bool] = _every
    checks: bool = True
    kept: frozenset[str] = frozenset()
    progress: Callable[[float], None] = _silent
    skipped: set[int] = field(default_factory=set)
    _kinds: dict[int, str] = field(default_factory=dict)
    _sizes: list[int] = field(default_factory=list)
    _file: int = -1

    @property
    def is_whole(self) -> bool:
        """Whether every topic is read."""
        return self.wanted is _every

    def begin(self, sizes: list[int]) -> None:
        """Begin a bag whose files have these sizes [bytes]."""
        self._sizes, self._file = sizes, -1

    def begin_file(self) -> None:
        """Begin the next file: it numbers its channels anew."""
        self.skipped.clear()
        self._kinds.clear()
        self._file += 1
        self.reached(0)

    def reached(self, at: int) -> None:
        """Report an offset in the file that is being read [bytes]."""
        total = sum(self._sizes)
        if total:
            self.progress(min(1.0, (sum(self._sizes[: self._file]) + at) / total))

    def see(self, record: Any) -> None:
        """Take a schema or a channel of the file, in their order; anything else says nothing."""
        if isinstance(record, Schema):
            self._kinds[record.id] = record.name
        elif isinstance(record, Channel):
            if self.wanted(record.topic, self._kinds.get(record.schema_id, "")):
                self.skipped.discard(record.id)
            else:
                self.skipped.add(record.id)
