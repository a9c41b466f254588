"""A bounded queue and a thread that empties it into a bag, so that receiving never waits for the disk.

When the disk is full or slow, messages wait in memory. When that is full too, further ones are dropped and counted by
topic; what waits is written as soon as the disk takes it.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import queue
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from fulmar_bags.writer import BagCounts
from fulmar_core.config.errors import BagError
from fulmar_core.config.yielding import BEHIND

MAX_QUEUED = 100_000  # messages that may wait for the thread
MAX_WAITING = 64 << 20  # bytes that may wait for the thread, and as many for a disk that refuses them
EMPTY_EVERY_S = 0.05  # longer batches wake the processor less often, shorter ones lose nothing less
PAUSE_S = 0.002  # between two looks of who waits for room
SLOW_S = 1.0  # a disk that takes longer for half a second of messages is a slow one
RECORDING = "fulmar_recording"  # entry of `custom_data`: JSON of `Account`


class Bag(Protocol):
    """Target of the thread: a `BagWriter`, a `BagRing` or a `BagPerGoal`."""

    @property
    def counts(self) -> BagCounts: ...  # noqa: D102 - as in `BagWriter`, all of them
    @property
    def waiting(self) -> int: ...  # noqa: D102
    def write(  # noqa: D102
        self, topic: str, data: bytes, *, log_ns: int, publish_ns: int | None = None
    ) -> None: ...
    def attach(self, name: str, data: bytes) -> None: ...  # noqa: D102
    def note(self, name: str, text: str) -> None: ...  # noqa: D102
    def tick(self, now: float) -> None: ...  # noqa: D102
    def close(self) -> None: ...  # noqa: D102


@dataclass(frozen=True)
class Account:
    """What became of the messages so far."""

    received: int  # messages offered
    recorded: int  # messages in the bag, where a reader finds them
    waiting: int  # bytes in memory
    size: int  # of the bag's MCAP files [bytes]
    files: int  # MCAP files
    dropped: dict[str, int] = field(default_factory=dict)  # messages by topic that found no room in memory
    unwritten: int = 0  # messages that the disk has not taken
    slowest_write_s: float = 0.0  # longest time that the disk took for one batch [s]
    problem: str = ""  # why the disk does not take what waits; empty if it does
    complete: bool = False  # whether the recording came to an orderly end

    @property
    def lost(self) -> int:
        """Messages that came and are not, or not yet, in the bag."""
        return sum(self.dropped.values()) + self.unwritten


class BagThread:
    """Writes a bag in a thread of its own; `put` never waits, unless it is patient."""

    def __init__(
        self,
        bag: Bag,
        *,
        on_error: Callable[[str], None],
        max_queued: int = MAX_QUEUED,
        max_waiting: int = MAX_WAITING,
        before: Mapping[str, Any] | None = None,
        patient: bool = False,
    ) -> None:
        """Start the thread.

        Args:
            bag: Used by this thread alone from now on.
            on_error: Receives each kind of trouble once, in one line.
            max_queued: Messages that may wait for the thread.
            max_waiting: Bytes that may wait for the thread, and as many for the disk.
            before: What `RECORDING` says of an interrupted bag that goes on; its counts are added in the bag.
            patient: Whether `put` waits for room, in lock step, where publishers wait, too.
        """
        self._patient = patient
        self._before = dict(before or {})
        self._bag, self._on_error = bag, on_error
        self._max_queued, self._max_waiting = max_queued, max_waiting
        self._queue: queue.SimpleQueue[tuple[str, bytes, int, int | None]] = queue.SimpleQueue()
        self._files: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()
        self._received = self._put_bytes = self._taken_bytes = 0  # each is changed by one thread alone
        self._crowded_out: Counter[str] = Counter()  # by `put`
        self._refused: Counter[str] = Counter()  # by the thread
        self._reported: set[str] = set()
        self._problem, self._slowest_s = "", 0.0
        self._ended = False  # by the thread, once it has closed the bag
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="bag", daemon=True)
        self._thread.start()

    @property
    def received(self) -> int:
        """Messages offered so far."""
        return self._received

    def put(self, topic: str, data: bytes, log_ns: int, publish_ns: int | None = None) -> None:
        """Offer a message, from one thread only; arguments as in `BagWriter.write`."""
        self._received += 1
        while self._patient and self.is_full and self._thread.is_alive():
            time.sleep(PAUSE_S)
        if self.is_full:
            self._crowded_out[topic] += 1
            self._report_once(
                "full", "the disk is too slow and memory is full: further messages are dropped."
            )
            return
        self._put_bytes += len(data)
        self._queue.put((topic, data, log_ns, publish_ns))

    @property
    def is_full(self) -> bool:
        """Whether there is no room: what comes is dropped, or, where `put` is patient, waits."""
        waiting = self._put_bytes - self._taken_bytes
        return self._queue.qsize() >= self._max_queued or waiting >= self._max_waiting

    def attach(self, name: str, data: bytes) -> None:
        """Carry a file along; from any thread."""
        self._files.put((name, data))

    def account(self, *, complete: bool = False) -> Account:
        """What became of the messages so far; from any thread."""
        counts = self._bag.counts
        return Account(
            received=self._received,
            recorded=counts.on_disk,
            waiting=self._put_bytes - self._taken_bytes + self._bag.waiting,
            size=counts.size,
            files=counts.files,
            dropped=dict(Counter(dict(self._crowded_out)) + Counter(dict(self._refused))),
            unwritten=counts.messages - counts.on_disk,
            slowest_write_s=self._slowest_s,
            problem=self._problem,
            complete=complete,
        )

    def stop(self) -> Account:
        """Write what waits, close the bag, and return the final account; what a dead thread left behind is lost."""
        self._stop.set()
        self._thread.join()
        while not self._ended and not self._queue.empty():
            self._crowded_out[self._queue.get()[0]] += 1
        return self.account(complete=self._ended)

    def _run(self) -> None:
        try:
            self._write()
            self._ended = True
        except Exception as error:  # noqa: BLE001 - whatever ends the recording is to be said
            self._problem = f"the recording broke off: {type(error).__name__}: {' '.join(str(error).split())}"
            self._on_error(self._problem)

    def _write(self) -> None:
        with contextlib.suppress(OSError, AttributeError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), BEHIND)  # compression and disk
        while not self._stop.wait(EMPTY_EVERY_S):
            self._empty()
            self._note(complete=False)
            self._try(lambda: self._bag.tick(time.monotonic()))
        self._empty()
        self._note(complete=True)
        self._try(self._bag.close)

    def _empty(self) -> None:
        while not self._files.empty():
            self._bag.attach(*self._files.get())
        for _ in range(self._queue.qsize()):
            topic, data, log_ns, publish_ns = self._queue.get()
            self._taken_bytes += len(data)
            if self._bag.waiting >= self._max_waiting:
                self._refused[topic] += 1
                continue
            try:
                self._bag.write(topic, data, log_ns=log_ns, publish_ns=publish_ns)
            except Exception:
                self._refused[topic] += 1
                raise

    def _note(self, *, complete: bool) -> None:
        account = self.account(complete=complete)
        received, dropped = self._before.get("received", 0), self._before.get("dropped", {})
        text: dict[str, Any] = {
            "complete": complete,
            "received": received + account.received,
            "dropped": dict(Counter(dropped) + Counter(account.dropped)),
        }
        if self._before:
            text["interruptions"] = self._before.get("interruptions", 0) + 1
        self._bag.note(RECORDING, json.dumps(text))

    def _try(self, action: Callable[[], None]) -> None:
        began = time.monotonic()
        try:
            action()
        except BagError as error:  # one that cannot begin its next bag
            self._problem = str(error)
            self._report_once(self._problem, self._problem)
        except OSError as error:
            self._problem = f"{_words(error)}: what comes waits in memory"
            self._report_once(str(error.errno), self._refusal(error))
        if self._problem and not self._bag.waiting:  # the disk has taken everything
            self._problem = ""
            self._reported.clear()
        self._slowest_s = max(self._slowest_s, time.monotonic() - began)

    def _report_once(self, kind: str, text: str) -> None:
        if kind not in self._reported:
            self._reported.add(kind)
            self._on_error(text)

    def _refusal(self, error: OSError) -> str:
        account = self.account()
        return (
            f"{_words(error)}. {account.recorded} messages are safe, {account.unwritten} and all that follow wait. "
            "Make room and they will be written."
        )


def _words(error: OSError) -> str:
    full = error.errno in (errno.ENOSPC, errno.EDQUOT)
    return "the disk is full" if full else str(error.strerror)
