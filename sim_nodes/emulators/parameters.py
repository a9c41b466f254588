"""Parameters of an emulated autopilot, asked for and set by MAVLink."""

from __future__ import annotations

import struct
from typing import Any

from sim_nodes.emulators.mavlink2 import link_to

WHOLE, REAL = 6, 9  # MAV_PARAM_TYPE_INT32 and REAL32
HEARTBEAT_S = 1.0
PX4, FIXED_WING = 12, 1  # MAV_AUTOPILOT_PX4, MAV_TYPE_FIXED_WING


class EmulatedParameters:
    """Values by name, as an autopilot keeps them.

    Attributes:
        values: By name; an int is a whole number.
        fixed: Names that take no value, as behind a lock.
        unknown: Names that get no answer, as in another release.
    """

    def __init__(self, values: dict[str, int | float], *, bytewise: bool) -> None:
        """Keep them; `bytewise` is PX4's way of sending whole numbers."""
        self.values, self._bytewise = dict(values), bytewise
        self.fixed: set[str] = set()
        self.unknown: set[str] = set()

    def take(self, message: Any, mav: Any) -> None:
        """Answer a question or a new value through a link's `mav`; others are none of them."""
        kind = message.get_type()
        if kind not in ("PARAM_REQUEST_READ", "PARAM_SET"):
            return
        name = message.param_id
        if name not in self.values or name in self.unknown:
            return
        if kind == "PARAM_SET" and name not in self.fixed:
            self.values[name] = self._read(message.param_value, isinstance(self.values[name], int))
        value = self.values[name]
        whole = isinstance(value, int)
        sent = struct.unpack("<f", struct.pack("<i", value))[0] if whole and self._bytewise else float(value)
        mav.param_value_send(name.encode(), sent, WHOLE if whole else REAL, len(self.values), 65535)

    def _read(self, value: float, whole: bool) -> int | float:
        if not whole:
            return float(value)
        return int(struct.unpack("<i", struct.pack("<f", value))[0]) if self._bytewise else round(value)


class Px4ParameterLink:
    """The MAVLink side of an emulated PX4, which has nothing but parameters."""

    def __init__(self, port: int, parameters: EmulatedParameters) -> None:
        """Speak to a UDP port of this host."""
        self._link, self.address = link_to(port)
        self._parameters, self._beaten_s = parameters, -1e9

    def serve(self, now_s: float) -> None:
        """Answer what has come by a time of the monotonic clock [s]."""
        if now_s - self._beaten_s >= HEARTBEAT_S:
            self._beaten_s = now_s
            self._link.mav.heartbeat_send(FIXED_WING, PX4, 0, 0, 4)
        while (message := self._link.recv_match(blocking=False)) is not None:
            self._parameters.take(message, self._link.mav)

    def close(self) -> None:
        """Close the link."""
        self._link.close()
