"""What guarded a recorded run: its limits, its e-stop, its fallback, and policies that took over on the way."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypedDict

from fulmar_bags.contents import Bag, json_object
from fulmar_bags.decode import messages
from fulmar_bags.received import Told
from fulmar_core.errors import BagError
from fulmar_core.safety.estop import TIMEOUT_NS, EstopMonitor
from fulmar_core.safety.geofence import NO_AREA
from fulmar_core.topics import ESTOP, ESTOP_RELEASED, METADATA, SWAP

# A message reaches the controller and the recorder at different times; what lies within is for the record to tell.
SLACK_NS = 50_000_000
RELEASED = "released"  # a reset, among the messages of the e-stop


class Limits(TypedDict):
    """Guards by the names that they have in `ControllerSettings`."""

    fallback: str
    estop: bool
    max_run_time_s: float
    area: tuple[float, float, float, float]


def limits_of(info: Mapping[str, Any]) -> Limits:
    """The guards that a run was started with; none where it names none.

    Raises:
        BagError: They make no sense.
    """
    told = info.get("guards") or {}
    try:
        x_min, x_max, y_min, y_max = (float(side) for side in told.get("area") or NO_AREA)
        return Limits(
            fallback=str(told.get("fallback") or ""),
            estop=bool(told.get("estop")),
            max_run_time_s=float(told.get("max_run_time_s") or 0.0),
            area=(x_min, x_max, y_min, y_max),
        )
    except (AttributeError, TypeError, ValueError) as error:
        raise BagError(f"the guards that the bag names make no sense: {error}.") from error


def number_of(info: Mapping[str, Any], name: str, default: float) -> float:
    """What a bag says of its run as a number; `default` where it says nothing, or 0.

    Raises:
        BagError: It is no number.
    """
    try:
        return float(info.get(name) or default)
    except (TypeError, ValueError) as error:
        raise BagError(f"what the bag says of its run makes no sense: {name}: {error}.") from error


def begins_with_its_run(info: Mapping[str, Any]) -> bool:
    """Whether a bag holds its run from the beginning, not only from a fault or a later goal on."""
    recording = info.get("recording")
    return not (isinstance(recording, Mapping) and recording.get("mode") in ("ring", "goals"))


def presses_of(bag: Bag) -> tuple[Told, ...]:
    """Messages of the e-stop, true for pressed, and its resets, `RELEASED`, in their order.

    Bags made before resets had a topic of their own do not list that topic: there the first "false" later than the
    timeout after a press ends it, as it did then.
    """
    said = [Told(log, 0, bool(message.data)) for log, message in messages(bag.of(ESTOP))]
    if bag.topic_name(ESTOP_RELEASED) not in bag.topics:
        return tuple(_with_resets(said))
    said += [Told(log, 0, RELEASED) for log, _ in messages(bag.of(ESTOP_RELEASED))]
    return tuple(sorted(said, key=lambda each: each.log_ns))


def _with_resets(said: list[Told]) -> list[Told]:
    result: list[Told] = []
    pressed_ns: int | None = None
    for each in said:
        if each.what:
            pressed_ns = each.log_ns
        elif pressed_ns is not None and each.log_ns - pressed_ns > TIMEOUT_NS:
            result.append(Told(each.log_ns, 0, RELEASED))
            pressed_ns = None
        result.append(each)
    return result


def changes_of(bag: Bag) -> tuple[Told, ...]:
    """Folder and SHA-256 of each policy that took over on request, told when it did; requests that failed are none."""
    asked = [(log, message.data) for log, message in messages(bag.of(SWAP))]
    said = [(log, json_object(message.data) or {}) for log, message in messages(bag.of(METADATA))]
    ends = [log for log, _ in asked[1:]] + [1 << 63]
    found = []
    for (begin, folder), end in zip(asked, ends, strict=False):
        new = [(log, words) for log, words in said if begin <= log < end and not words.get("fallback")]
        if new:
            log, words = new[0]
            found.append(Told(log, 0, (folder, str(words.get("sha256") or ""))))
    return tuple(found)


class RecordedEstop:
    """The e-stop as the controller received it: at one instant, not yet and already, by the slack of the record.

    Attributes:
        recorded: Whether the controller acted in the record, at the time of the next call; this decides while a press
            or a release was on its way.
    """

    def __init__(self, presses: tuple[Told, ...], *, required: bool) -> None:
        """Begin without having received anything.

        Args:
            presses: From `presses_of`.
            required: Whether nothing may move before it is heard.

        Raises:
            BagError: It is required, and the bag holds nothing of it.
        """
        if required and not presses:
            raise BagError("the run was guarded by an e-stop, of which the bag holds nothing.")
        self._late, self._early = (_Ear(presses, required, offset) for offset in (-SLACK_NS, SLACK_NS))
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


class _Ear:
    """Hears everything somewhat earlier or later than the recorder."""

    def __init__(self, presses: tuple[Told, ...], required: bool, offset_ns: int) -> None:
        self.watch = EstopMonitor(required=required)
        self._rest = iter(presses)
        self._next = next(self._rest, None)
        self._offset_ns = offset_ns

    def reason(self, log_ns: int) -> str:
        now_ns = log_ns + self._offset_ns
        while self._next is not None and self._next.log_ns <= now_ns:
            if self._next.what == RELEASED:
                self.watch.release(self._next.log_ns)
            else:
                self.watch.receive(self._next.what, self._next.log_ns)
            self._next = next(self._rest, None)
        return self.watch.reason(now_ns)
