"""What an autopilot says of itself: mode, arming and words; and why it does not carry out what it is sent."""

from __future__ import annotations

import threading
from collections import deque
from typing import Any, ClassVar

MANUAL = 0  # of ArduPilot's rover and boat modes
MODES = {
    0: "MANUAL", 1: "ACRO", 3: "STEERING", 4: "HOLD", 5: "LOITER", 6: "FOLLOW", 7: "SIMPLE", 8: "DOCK", 9: "CIRCLE",
    10: "AUTO", 11: "RTL", 12: "SMART_RTL", 15: "GUIDED", 16: "INITIALISING",
}  # fmt: skip
ARDUPILOT = 3  # MAV_AUTOPILOT; others, such as PX4, number their modes in their own way
ROVER, BOAT = 10, 11  # MAV_TYPE of ArduPilot's Rover; mode 0 of its Copter is STABILIZE, not MANUAL
ARMED = 128  # MAV_MODE_FLAG_SAFETY_ARMED
CRITICAL = 5  # MAV_STATE: from here on a failsafe acts
ERROR = 3  # MAV_SEVERITY: what is said with this number or a lower one is a warning
UNKNOWN = 65535  # of a channel that an autopilot does not have
BEATLESS_S = 3.5  # after three heartbeats and a half, mode and arming are not known any more
SAID_S = 10.0  # so long its words count as of now
LAG_S = 1.0  # from an override to the report of its channel, and so long may a channel differ
CLOSE_US = 20  # of two pulses that are the same


class Autopilot:
    """State of an ArduPilot boat by its own messages; they come in one thread, and questions in any.

    Attributes:
        mode: Number of its mode; None: not known yet.
        armed: Whether the propellers may turn.
        stranger: What it is, in words, where it is none of `KINDS` of ArduPilot; empty otherwise.
        failsafe: Whether it says that a failsafe acts.
        beats: Heartbeats so far.
    """

    KINDS: ClassVar[tuple[int, ...]] = (ROVER, BOAT)  # MAV_TYPE of what may be driven, and its name
    WANTED: ClassVar[str] = "ArduPilot Rover or boat"

    def __init__(self, steering_channel: int, throttle_channel: int) -> None:
        """Begin with nothing known; the channels are those that are overridden, from 1 on."""
        self.mode: int | None = None
        self.armed = self.failsafe = False
        self.beats, self.stranger = 0, ""
        self._fields = tuple(f"chan{number}_raw" for number in (steering_channel, throttle_channel))
        self._lock = threading.Lock()
        self._beaten_s: float | None = None
        self._said: deque[tuple[float, int, str]] = deque(maxlen=3)  # when, severity, words
        self._sent: deque[tuple[float, tuple[int, int]]] = deque()  # when, and pulses
        self._astray_s: float | None = None  # since when a channel differs
        self._astray = False

    def take(self, message: Any, now_s: float) -> None:
        """Take a message of the autopilot at a time of the steady clock [s]."""
        kind = message.get_type()
        if kind == "HEARTBEAT":
            self.mode, self.armed = int(message.custom_mode), bool(message.base_mode & ARMED)
            known = message.autopilot == ARDUPILOT and message.type in self.KINDS
            found = f"(MAV_AUTOPILOT {message.autopilot}, MAV_TYPE {message.type})"
            self.stranger = "" if known else f"no {self.WANTED} {found}"
            self.failsafe = message.system_status >= CRITICAL
            self._beaten_s = now_s
            self.beats += 1
        elif kind == "STATUSTEXT":
            with self._lock:
                self._said.append((now_s, int(message.severity), _printable(str(message.text))))
        elif kind == "RC_CHANNELS":
            self._compare([getattr(message, field) for field in self._fields], now_s)

    def note_sent(self, steering: int, throttle: int, now_s: float) -> None:
        """Note the pulses of an override [µs]."""
        with self._lock:
            self._sent.append((now_s, (steering, throttle)))
            # The last one before the time that counts was still in force when that began.
            while len(self._sent) > 1 and self._sent[1][0] < now_s - LAG_S:
                self._sent.popleft()

    def refusal(self, now_s: float) -> str:
        """Why overrides do nothing now, in words that stay the same meanwhile; empty while they do something."""
        if self._beaten_s is None or now_s - self._beaten_s > BEATLESS_S:
            return f"the autopilot has sent no heartbeat for {BEATLESS_S:g} s: its mode is not known"
        if self.stranger:
            return f"the autopilot is {self.stranger}: what its modes and channels mean is not known"
        if self.mode != MANUAL:
            return f"the autopilot is in mode {self.mode_name}, not MANUAL: overrides do nothing"
        if not self.armed:
            return "the autopilot is not armed: its propellers stand"
        if self._astray:
            return (
                "the autopilot does not take the overrides: its channels differ from what is sent. "
                "Is its SYSID_MYGCS 255?"
            )
        return ""

    @property
    def mode_name(self) -> str:
        """Its mode as number and name; empty as long as it is not known."""
        if self.mode is None:
            return ""
        return f"{self.mode} ({MODES[self.mode]})" if self.mode in MODES else str(self.mode)

    def words(self, now_s: float, *, worst: int = 7) -> str:
        """What it has said lately, the newest last; only with a severity number up to `worst`."""
        with self._lock:
            said = [
                text for at_s, severity, text in self._said if now_s - at_s < SAID_S and severity <= worst
            ]
        return "; ".join(f"'{text}'" for text in dict.fromkeys(said))

    def _compare(self, pulses: list[int], now_s: float) -> None:
        """Note whether channels have differed for long from all that was sent lately."""
        with self._lock:
            sent = list(self._sent)
        if not sent or now_s - sent[0][0] < LAG_S or now_s - sent[-1][0] > LAG_S:
            self._astray_s, self._astray = None, False
            return
        columns = zip(*(pair for _, pair in sent), strict=True)
        differ = any(
            pulse != UNKNOWN and not min(column) - CLOSE_US <= pulse <= max(column) + CLOSE_US
            for pulse, column in zip(pulses, columns, strict=True)
        )
        if not differ:
            self._astray_s, self._astray = None, False
            return
        self._astray_s = now_s if self._astray_s is None else self._astray_s
        self._astray = now_s - self._astray_s >= LAG_S


def _printable(text: str) -> str:
    """Words of a device without what a terminal would carry out."""
    return "".join(letter if letter.isprintable() else "?" for letter in text).strip()
