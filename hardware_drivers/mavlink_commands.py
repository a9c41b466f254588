"""Commands to an autopilot, and its acknowledgements."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hardware_drivers.mavlink_link import HOST_COMPONENT, HOST_SYSTEM, Address

AGAIN_S = 0.3  # a command without an answer is sent again after so long
ANYONE = 0  # as the target of an acknowledgement
RESULTS = {
    mavlink.MAV_RESULT_TEMPORARILY_REJECTED: "rejected for now",
    mavlink.MAV_RESULT_DENIED: "denied",
    mavlink.MAV_RESULT_UNSUPPORTED: "not supported",
    mavlink.MAV_RESULT_FAILED: "failed",
    mavlink.MAV_RESULT_IN_PROGRESS: "still in progress",
}
MAY_CHANGE = (mavlink.MAV_RESULT_TEMPORARILY_REJECTED, mavlink.MAV_RESULT_IN_PROGRESS)


class Commands:
    """Sends COMMAND_LONG; acknowledgements come from another thread, by `take`.

    Attributes:
        refused: Number and result of the last command that was not accepted, in words; empty where all were.
    """

    def __init__(self, send: Callable[[Any], None], autopilot: Address) -> None:
        """Command an autopilot; `send` raises OSError."""
        self._send, self._autopilot = send, autopilot
        self._answered = threading.Condition()
        self._results: dict[int, int] = {}  # newest, by command
        self.refused = ""

    def tell(self, number: int, first: float, second: float = 0.0) -> None:
        """Send a command once, and wait for nothing; raises OSError."""
        self._send(
            mavlink.MAVLink_command_long_message(
                *self._autopilot, number, 0, first, second, 0.0, 0.0, 0.0, 0.0, 0.0
            )
        )

    def ask(
        self, number: int, first: float, second: float = 0.0, *, done: Callable[[], bool], within_s: float
    ) -> str:
        """Send a command until its effect is there.

        Args:
            number: MAV_CMD.
            first: Its first parameter.
            second: Its second one.
            done: Whether the autopilot reports the effect.
            within_s: Wait so long [s].

        Returns:
            Why not, in words; empty where it is done.

        Raises:
            OSError: The link is gone.
        """
        until, result = time.monotonic() + within_s, None
        with self._answered:
            self._results.pop(number, None)
        while True:
            if result is None or result in MAY_CHANGE:
                self.tell(number, first, second)
            with self._answered:
                self._answered.wait_for(done, AGAIN_S)
                result = self._results.get(number, result)
            if done():
                return ""
            if result not in (None, mavlink.MAV_RESULT_ACCEPTED, *MAY_CHANGE):
                return RESULTS.get(result, f"result {result}")
            if time.monotonic() > until:
                accepted = "accepted, but it does not show"
                return RESULTS.get(result, accepted) if result is not None else "no answer"

    def take(self, message: Any) -> None:
        """Take any message of the autopilot: acknowledgements count, and others may be the effect."""
        with self._answered:
            if message.get_type() == "COMMAND_ACK" and _is_for_us(message):
                self._results[message.command] = message.result
                if message.result not in (mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_IN_PROGRESS):
                    words = RESULTS.get(message.result, f"result {message.result}")
                    self.refused = f"{_name_of(message.command)}: {words}"
            self._answered.notify_all()


def _is_for_us(acknowledgement: Any) -> bool:
    """Whether it answers a command of ours, not of another ground station."""
    systems, components = (ANYONE, HOST_SYSTEM), (ANYONE, HOST_COMPONENT)
    return acknowledgement.target_system in systems and acknowledgement.target_component in components


def _name_of(command: int) -> str:
    entry = mavlink.enums["MAV_CMD"].get(command)
    return str(entry.name) if entry is not None else f"command {command}"
