"""States that a plant has sent, and which of them a command may still answer."""

from __future__ import annotations

from collections import OrderedDict

REMEMBERED = 256  # states whose answer may still come, at least


class SentStates:
    """Remembers stamps of the plant's clock with the steady time of their sending. Not thread-safe."""

    def __init__(self, too_old_ns: int) -> None:
        """Begin empty; a command may answer a state that was sent at most `too_old_ns` ago, > 0 [ns]."""
        self._too_old_ns = too_old_ns
        self._waiting: OrderedDict[int, int] = OrderedDict()  # stamp to time of sending; no answer yet
        self._young: OrderedDict[int, int] = OrderedDict()  # the same, of all that may still be answered
        self._newest_ns = 0
        self._outdated_ns = 0  # every stamp up to this one is too old

    def note(self, stamp_ns: int, now_ns: int) -> None:
        """Note that a state of a stamp [ns] was sent now, by a steady clock [ns]; of repetitions the first counts."""
        if not self._newest_ns or stamp_ns < self._newest_ns:  # the first, or the clock was set back
            self._waiting.clear()
            self._young.clear()
            self._outdated_ns = stamp_ns - 1
        self._newest_ns = stamp_ns
        self._waiting.setdefault(stamp_ns, now_ns)
        self._young.setdefault(stamp_ns, now_ns)
        self._age(now_ns)
        while len(self._waiting) > REMEMBERED:
            self._waiting.popitem(last=False)

    def outdated(self, stamp_ns: int, now_ns: int) -> bool:
        """Whether a stamp is that of a state which is too old by now; never for 0, which stands for none."""
        self._age(now_ns)
        return 0 < stamp_ns <= self._outdated_ns

    def answered(self, stamp_ns: int, now_ns: int) -> int | None:
        """How long the first answer to a state took; None for any other answer [ns]."""
        sent_ns = self._waiting.pop(stamp_ns, None)
        return None if sent_ns is None else now_ns - sent_ns

    def close(self) -> None:
        """Accept and time no more answers to what was sent so far."""
        self._waiting.clear()
        self._young.clear()
        self._outdated_ns = self._newest_ns

    def _age(self, now_ns: int) -> None:
        while self._young:
            stamp_ns, sent_ns = next(iter(self._young.items()))
            if now_ns - sent_ns <= self._too_old_ns:
                return
            self._young.popitem(last=False)
            self._outdated_ns = stamp_ns
