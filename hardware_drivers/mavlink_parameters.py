"""Parameters of an autopilot by MAVLink: read, set where they differ, and read again.

ArduPilot sends whole numbers as floats; PX4 sends the bits of an int32 in the field of the float.
"""

from __future__ import annotations

import math
import struct
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hardware_drivers.mavlink_link import Address

AGAIN_S = 0.3  # a question without an answer is asked again after so long
CLOSE = 1e-4  # of two floats that are the same


@dataclass(frozen=True)
class Wanted:
    """A parameter of a failsafe, and the values that protect."""

    names: tuple[str, ...]  # of the parameter; the later ones in other releases
    value: float  # that is set where the present one does not protect
    accepts: Callable[[float], bool]
    why: str  # what it is for, for a person who has to set it

    @property
    def name(self) -> str:
        """The first of its names."""
        return self.names[0]


class Parameters:
    """Reads and sets parameters; PARAM_VALUE comes from another thread, by `take`."""

    def __init__(self, send: Callable[[Any], None], autopilot: Address, *, bytewise: bool) -> None:
        """Talk to an autopilot; `send` raises OSError, `bytewise` is PX4's way of sending whole numbers."""
        self._send, self._autopilot, self._bytewise = send, autopilot, bytewise
        self._answered = threading.Condition()
        self._values: dict[str, tuple[float, int]] = {}  # and type, by name

    def take(self, message: Any) -> None:
        """Take any message of the autopilot."""
        if message.get_type() == "PARAM_VALUE":
            name = str(message.param_id).rstrip("\0")
            with self._answered:
                self._values[name] = (
                    self._decoded(message.param_value, message.param_type),
                    message.param_type,
                )
                self._answered.notify_all()

    def read(self, name: str, within_s: float) -> float | None:
        """Present value; None where no answer comes in time [s]. Raises OSError."""
        with self._answered:
            self._values.pop(name, None)

        def ask() -> None:
            self._send(mavlink.MAVLink_param_request_read_message(*self._autopilot, name.encode(), -1))

        return self._until(name, ask, lambda _value: True, within_s)

    def protect(self, wanted: Sequence[Wanted], within_s: float) -> str:
        """Set each parameter that does not protect, and read it again.

        Returns:
            What could not be confirmed, and what a person has to set; empty where all protect.

        Raises:
            OSError: The link is gone.
        """
        for each in wanted:
            found = next(
                ((name, value) for name in each.names if (value := self.read(name, within_s)) is not None),
                None,
            )
            if found is None:
                return f"it says nothing of its parameter {each.name}: set it to {each.value:g} ({each.why})"
            name, value = found
            if each.accepts(value):
                continue
            changed = self._set(name, each.value, within_s)
            if changed is None or not each.accepts(changed):
                now = value if changed is None else changed
                return f"its parameter {name} stays {now:g}: set it to {each.value:g} ({each.why})"
        return ""

    def _set(self, name: str, value: float, within_s: float) -> float | None:
        kind = self._values[name][1]

        def ask() -> None:
            encoded = self._encoded(value, kind)
            self._send(mavlink.MAVLink_param_set_message(*self._autopilot, name.encode(), encoded, kind))

        self._until(name, ask, lambda now: math.isclose(now, value, rel_tol=CLOSE), within_s)
        return self.read(name, within_s)

    def _until(
        self, name: str, ask: Callable[[], None], done: Callable[[float], bool], within_s: float
    ) -> float | None:
        end_s = time.monotonic() + within_s

        def is_done() -> bool:
            return name in self._values and done(self._values[name][0])

        while True:
            ask()
            with self._answered:
                self._answered.wait_for(is_done, AGAIN_S)
                if is_done() or time.monotonic() > end_s:
                    return self._values[name][0] if name in self._values else None

    def _decoded(self, value: float, kind: int) -> float:
        if self._bytewise and kind == mavlink.MAV_PARAM_TYPE_INT32:
            return float(struct.unpack("<i", struct.pack("<f", value))[0])
        return float(value)

    def _encoded(self, value: float, kind: int) -> float:
        if self._bytewise and kind == mavlink.MAV_PARAM_TYPE_INT32:
            return float(struct.unpack("<f", struct.pack("<i", round(value)))[0])
        return float(value)
