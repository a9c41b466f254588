"""What PX4 says of itself by px4_msgs: mode, arming, answers to commands, and its clock."""

from __future__ import annotations

import threading
from typing import Any

OFFBOARD = 14  # of nav_state
ARMED = 2  # of arming_state
FIXED_WING = 2  # of vehicle_type
MODES = {
    0: "MANUAL", 1: "ALTCTL", 2: "POSCTL", 3: "AUTO_MISSION", 4: "AUTO_LOITER", 5: "AUTO_RTL", 6: "POSITION_SLOW",
    10: "ACRO", 12: "DESCEND", 13: "TERMINATION", OFFBOARD: "OFFBOARD", 15: "STAB", 17: "AUTO_TAKEOFF", 18: "AUTO_LAND",
    20: "AUTO_PRECLAND", 21: "ORBIT",
}  # fmt: skip
STALE_S = 2.5  # PX4 sends its status twice a second, and at each change
RESULTS = {
    1: "rejected for now", 2: "denied", 3: "not supported", 4: "failed", 5: "still in progress", 6: "cancelled",
}  # fmt: skip
ACCEPTED = 0


class Px4Vehicle:
    """State of PX4 by its own messages; they come in one thread, and questions in any.

    Attributes:
        nav_state: Number of its mode; None: not known yet.
        armed: Whether its outputs may move.
        failsafe: Whether it says that a failsafe acts.
        kind: vehicle_type; 2 is a fixed wing.
        offset_us: Between this computer's clock and PX4's, as TimesyncStatus says; None: not known [µs].
        round_trip_us: Of the newest exchange of clocks [µs].
        refused: The last command that was not accepted, in words; empty where all were.
    """

    def __init__(self) -> None:
        """Begin with nothing known."""
        self.nav_state: int | None = None
        self.armed = self.failsafe = False
        self.kind = 0
        self.offset_us: int | None = None
        self.round_trip_us = 0
        self.refused = ""
        self._said_s: float | None = None
        self._changed = threading.Condition()
        self._results: dict[int, int] = {}

    def take(self, kind: str, message: Any, now_s: float) -> None:
        """Take a message by the name of its type, at a time of the steady clock [s]."""
        with self._changed:
            if kind == "VehicleStatus":
                self.nav_state, self.armed = int(message.nav_state), int(message.arming_state) == ARMED
                self.failsafe, self.kind = bool(message.failsafe), int(message.vehicle_type)
                self._said_s = now_s
            elif kind == "VehicleCommandAck":
                self._results[int(message.command)] = int(message.result)
                if message.result not in (ACCEPTED, 5):
                    self.refused = f"command {message.command}: {RESULTS.get(message.result, message.result)}"
            elif kind == "TimesyncStatus":
                self.offset_us, self.round_trip_us = (
                    int(message.estimated_offset),
                    int(message.round_trip_time),
                )
            self._changed.notify_all()

    def forget(self, command: int) -> None:
        """Forget the answer to a command, before it is sent anew."""
        with self._changed:
            self._results.pop(command, None)

    def answer(self, command: int) -> str:
        """Why a command was not accepted, in words; empty where it was, or nothing has come."""
        result = self._results.get(command, ACCEPTED)
        return "" if result == ACCEPTED else RESULTS.get(result, f"result {result}")

    def wait(self, timeout_s: float) -> None:
        """Wait for the next message, at most so long [s]."""
        with self._changed:
            self._changed.wait(timeout_s)

    def is_stale(self, now_s: float) -> bool:
        """Whether its status is not known any more."""
        return self._said_s is None or now_s - self._said_s > STALE_S

    @property
    def offboard(self) -> bool:
        """Whether it takes set points."""
        return self.nav_state == OFFBOARD

    @property
    def mode_name(self) -> str:
        """Its mode as number and name; empty as long as it is not known."""
        if self.nav_state is None:
            return ""
        return (
            f"{self.nav_state} ({MODES[self.nav_state]})" if self.nav_state in MODES else str(self.nav_state)
        )
