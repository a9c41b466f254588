"""What drivers of an autopilot by MAVLink have in common: the open link, its thread, and what the autopilot is."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from fulmar_core.config.errors import DeviceError
from hardware_drivers.feedback import Feedback
from hardware_drivers.mavlink_autopilot import Autopilot
from hardware_drivers.mavlink_commands import Commands
from hardware_drivers.mavlink_link import Address, heartbeat, open_link, wait_for_autopilot
from hardware_drivers.mavlink_signing import read_key

BEATEN_S = 3.0  # our value: autopilots send a heartbeat a second


class Addressed(Protocol):
    """Settings of a driver by MAVLink: where the autopilot is, and what signs."""

    @property
    def port(self) -> str:
        """As in `place_of`."""
        ...

    @property
    def baud(self) -> int:
        """Of a serial port."""
        ...

    @property
    def signing_key(self) -> str:
        """File with the key; empty: nothing is signed."""
        ...


class MavlinkSession:
    """An open link with a thread that receives, and sends heartbeats.

    Attributes:
        name: Of the autopilot, in messages.
        link: What was opened.
        autopilot: Its address, as of `meet`.
        commands: To it, as of `meet`; None before.
        over: Set once the thread is to end.
    """

    autopilot: Address

    def __init__(
        self,
        settings: Addressed,
        feedback: Feedback,
        take: Callable[[Any], None],
        *,
        patience_s: float,
        beat_s: float,
        beats: Callable[[], bool] = lambda: True,
    ) -> None:
        """Open the link, and receive.

        Args:
            settings: Where the autopilot is.
            feedback: Fails once the link is gone.
            take: Called with every message of the autopilot, from the thread.
            patience_s: For the link, and for the autopilot to speak [s].
            beat_s: Between two heartbeats of ours [s].
            beats: Whether one may be sent now.

        Raises:
            ConfigError: The file with the key of its signatures cannot be used.
            DeviceError: The link cannot be opened.
        """
        self.name = f"autopilot at {settings.port}"
        self._port, self._patience_s, self._feedback, self._take = settings.port, patience_s, feedback, take
        self._beat_s, self._beats = beat_s, beats
        self.commands: Commands | None = None
        self.over = threading.Event()
        key = read_key(settings.signing_key) if settings.signing_key else b""
        self.link = open_link(settings.port, settings.baud, key, patience_s)
        self._thread = threading.Thread(target=self._run, name="mavlink reader", daemon=True)
        self._thread.start()

    @contextlib.contextmanager
    def connecting(self, release: Callable[[], None] = lambda: None) -> Iterator[None]:
        """Meet the autopilot, prepare it in the block, and wait for its first report; the link is closed on errors.

        Args:
            release: What leaves a prepared autopilot safe after an error; may raise OSError.

        Raises:
            DeviceError: The autopilot does not answer, or the link is gone.
        """
        try:
            self.autopilot = wait_for_autopilot(self.link, self._port, self._patience_s)
            yield
            self._feedback.wait(self._patience_s)
        except OSError as error:
            self.close()
            raise DeviceError(f"{self.name}: the link is gone ({error}).") from error
        except BaseException:
            with contextlib.suppress(OSError):
                release()
            self.close()
            raise

    def ask_for(self, rates_hz: Mapping[str, float]) -> Commands:
        """Ask for telemetry: messages by their names, and how often [Hz]; returns what sends commands from now on."""
        self.commands = commands = Commands(self.link.send, self.autopilot)
        for name, rate in rates_hz.items():
            kind = getattr(mavlink, f"MAVLINK_MSG_ID_{name}")
            commands.tell(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, float(kind), 1e6 / rate)
        return commands

    def await_heartbeat(self, state: Autopilot) -> None:
        """Wait for a while until a heartbeat says what the autopilot is: nothing else may be set or armed."""
        end_s = time.monotonic() + BEATEN_S
        while not state.beats and time.monotonic() < end_s:
            time.sleep(0.02)

    def health(self, state: Autopilot, *, refused_positions: int) -> dict[str, str]:
        """Mode, arming and words of the autopilot, and what was refused; see `DeviceDriver.health`."""
        return {
            "armed": str(state.armed).lower(),
            "autopilot_mode": state.mode_name,
            "autopilot_says": state.words(time.monotonic()),
            "refused_commands": self.commands.refused if self.commands else "",
            "refused_messages": str(self.link.refused),
            "refused_positions": str(refused_positions),
        }

    def close(self) -> None:
        """End the thread, and close the link."""
        self.over.set()
        self._thread.join(0.5)
        with contextlib.suppress(OSError):
            self.link.close()

    def _run(self) -> None:
        beaten_s, known = 0.0, False
        while not self.over.is_set():
            now_s, there = time.monotonic(), self.link.autopilot is not None
            try:
                # At once to an autopilot that has just spoken: what was sent before may not have reached it.
                if (now_s - beaten_s >= self._beat_s or known is not there) and self._beats():
                    beaten_s, known = now_s, there
                    self.link.send(heartbeat())
                for message in self.link.receive():
                    if self.commands is not None:
                        self.commands.take(message)
                    self._take(message)
            except Exception as error:  # noqa: BLE001 - a thread that died in silence would look like a silent autopilot
                if not self.over.is_set():
                    self._feedback.fail(f"the link is gone ({type(error).__name__}: {error})")
                return
