"""The e-stop of a recorded run, as its controller received it."""

from __future__ import annotations

from fulmar_bags.wire_reader import Received, WireReader
from fulmar_core.config.errors import BagError
from fulmar_core.robots.topics import ESTOP, ESTOP_RELEASED
from fulmar_core.safety.estop import TIMEOUT_NS, EstopMonitor

# A message reaches the controller and the recorder at different times; within this span the record decides.
SLACK_NS = 50_000_000
RELEASED = "released"  # a reset, among the messages of the e-stop


def estop_messages(reader: WireReader) -> tuple[Received, ...]:
    """Messages of the e-stop, true for pressed, and its resets, `RELEASED`, in their order.

    Bags made before resets had a topic of their own do not list that topic: there the first "false" later than the
    timeout after a press ends it, as it did then.
    """
    states = [Received(each.log_ns, 0, bool(each.value)) for each in reader.received(ESTOP)]
    if reader.bag.topic_name(ESTOP_RELEASED) not in reader.bag.topics:
        return tuple(_with_resets(states))
    resets = [Received(each.log_ns, 0, RELEASED) for each in reader.received(ESTOP_RELEASED)]
    return tuple(sorted(states + resets, key=lambda each: each.log_ns))


def _with_resets(states: list[Received]) -> list[Received]:
    result: list[Received] = []
    pressed_ns: int | None = None
    for each in states:
        if each.value:
            pressed_ns = each.log_ns
        elif pressed_ns is not None and each.log_ns - pressed_ns > TIMEOUT_NS:
            result.append(Received(each.log_ns, 0, RELEASED))
            pressed_ns = None
        result.append(each)
    return result


class RecordedEstop:
    """The e-stop as the controller received it: at one instant, not yet and already, by the slack of the record.

    Attributes:
        recorded: Whether the controller acted in the record, at the time of the next call; this decides while a press
            or a release was on its way.
    """

    def __init__(self, messages: tuple[Received, ...], *, required: bool) -> None:
        """Begin without having received anything.

        Args:
            messages: From `estop_messages`.
            required: Whether nothing may move before the first message.

        Raises:
            BagError: It is required, and the bag holds nothing of it.
        """
        if required and not messages:
            raise BagError("the run was guarded by an e-stop, and the bag holds no message of it.")
        self._late, self._early = (
            _ShiftedWatch(messages, required, offset) for offset in (-SLACK_NS, SLACK_NS)
        )
        self._stops = False
        self.recorded = False

    @property
    def received(self) -> bool:
        """Whether it was received, and stopped everything without a doubt, at the time of the last call."""
        return self._stops and self._late.watch.received and self._early.watch.received

    def reason(self, now_ns: int) -> str:
        """Why nothing may move at a time of the record, not before the one of the last call [ns]; empty if it may."""
        late, early = self._late.reason(now_ns), self._early.reason(now_ns)
        self._stops = bool(late) and bool(early)
        if bool(late) == bool(early):
            return early
        return "" if self.recorded else late or early


class _ShiftedWatch:
    """An e-stop watch that receives everything somewhat earlier or later than the recorder."""

    def __init__(self, messages: tuple[Received, ...], required: bool, offset_ns: int) -> None:
        self.watch = EstopMonitor(required=required)
        self._rest = iter(messages)
        self._next = next(self._rest, None)
        self._offset_ns = offset_ns

    def reason(self, log_ns: int) -> str:
        now_ns = log_ns + self._offset_ns
        while self._next is not None and self._next.log_ns <= now_ns:
            if self._next.value == RELEASED:
                self.watch.release(self._next.log_ns)
            else:
                self.watch.receive(self._next.value, self._next.log_ns)
            self._next = next(self._rest, None)
        return self.watch.reason(now_ns)
