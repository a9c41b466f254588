"""A bounded queue and a thread that empties it into a bag, so that receiving never waits for the disk."""

from __future__ import annotations

import errno
import queue
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from fulmar_ros.bag_writer import BagWriter

MAX_QUEUED = 100_000  # messages that may wait for the thread
MAX_WAITING = 64 << 20  # bytes that may wait for a disk that refuses them
EMPTY_EVERY_S = 0.05  # longer batches wake the processor less often, shorter ones lose nothing less


@dataclass(frozen=True)
class Outcome:
    """How a recording went."""

    received: int  # messages offered
    recorded: int  # messages in the bag
    size: int  # of the bag's MCAP file [bytes]

    @property
    def lost(self) -> int:
        """Messages that came but are not in the bag."""
        return self.received - self.recorded


@dataclass(frozen=True, slots=True)
class _Message:
    topic: str
    data: bytes
    log_ns: int


class BagThread:
    """Writes a bag in a thread of its own; `put` never waits."""

    def __init__(
        self, bag: BagWriter, *, on_error: Callable[[str], None], max_queued: int = MAX_QUEUED
    ) -> None:
        """Start the thread.

        Args:
            bag: Used by this thread alone from now on.
            on_error: Told once, in one line, when something cannot be kept.
            max_queued: Messages that may wait.
        """
        self._bag, self._tell, self._max_queued = bag, on_error, max_queued
        self._queue: queue.SimpleQueue[_Message] = queue.SimpleQueue()
        self._received = 0
        self._failed = self._overflowed = False
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="bag", daemon=True)
        self._thread.start()

    @property
    def received(self) -> int:
        """Messages offered so far."""
        return self._received

    def put(self, topic: str, data: bytes, log_ns: int) -> None:
        """Offer a message; arguments as in `BagWriter.write`."""
        self._received += 1
        if self._queue.qsize() >= self._max_queued:
            if not self._overflowed:
                self._overflowed = True
                self._tell(f"{self._max_queued} messages wait for the disk: further ones are dropped.")
            return
        self._queue.put(_Message(topic, data, log_ns))

    def stop(self) -> Outcome:
        """Write what waits, close the bag, and say how it went."""
        self._stop.set()
        self._thread.join()
        return Outcome(self._received, self._bag.messages_on_disk, self._bag.size)

    def _run(self) -> None:
        while not self._stop.wait(EMPTY_EVERY_S):
            self._empty()
            self._try(lambda: self._bag.tick(time.monotonic()))
        self._empty()
        self._try(self._bag.close)

    def _empty(self) -> None:
        for _ in range(self._queue.qsize()):
            message = self._queue.get()
            if self._bag.waiting < MAX_WAITING:
                self._bag.write(message.topic, message.data, log_ns=message.log_ns)

    def _try(self, action: Callable[[], None]) -> None:
        try:
            action()
        except OSError as error:
            if not self._failed:
                self._failed = True
                self._tell(_reason(error, self._bag))


def _reason(error: OSError, bag: BagWriter) -> str:
    what = "the disk is full" if error.errno in (errno.ENOSPC, errno.EDQUOT) else error.strerror
    return (
        f"{bag.directory}: {what}. {bag.messages_on_disk} messages are safe, "
        f"{bag.messages - bag.messages_on_disk} and all that follow wait. Make room and they will be written."
    )
