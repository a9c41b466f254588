"""A link to X-Plane that finds out whether it is there, and sends."""

from __future__ import annotations

import threading
import time

from fulmar_core.config.errors import DeviceError
from hardware_drivers.ports import Reader, open_port
from hardware_drivers.xplane_messages import AskPosition, Message, Position, Values
from hardware_drivers.xplane_pause import Pause
from hardware_drivers.xplane_protocol import MalformedError, decode, encode

ASK_S = 0.2  # a question that had no answer for so long is asked again [s]
PAUSE_S = 1.0  # for it to pause [s]
HINT = "Does X-Plane run there, with the plugin XPlaneConnect?"


class XPlaneLink:
    """Sends messages to an X-Plane that answers."""

    def __init__(self, port: str, *, within_s: float) -> None:
        """Open it, and wait for the first answer.

        Args:
            port: udp://host:port of the plugin.
            within_s: Wait so long [s].

        Raises:
            ConfigError: The port is malformed.
            DeviceError: Nothing answers, or what answers is no X-Plane.
        """
        self._address, self._refusal = port, ""
        self._answered = threading.Event()
        self._answered_s = time.monotonic()
        self._port, self._pause = open_port(port, 0, 0.0), Pause(self.send)
        self._reader = Reader(self._port, self._take, self._end)
        until = time.monotonic() + within_s
        try:
            while not self._answered.is_set():
                if time.monotonic() > until:
                    raise DeviceError(f"{port}: no answer within {within_s:.1f} s{self._refusal}. {HINT}")
                self.ask()
                self._answered.wait(ASK_S)
        except BaseException:
            self.close()
            raise

    def send(self, message: Message) -> None:
        """Send a message; a host that is not there loses it.

        Raises:
            DeviceError: The network of this computer does not take it.
        """
        try:
            self._port.write(encode(message))
        except OSError as error:
            raise DeviceError(
                f"{self._address}: not sent ({error}). Look at this computer's network."
            ) from error

    def ask(self) -> None:
        """Ask for an answer."""
        self.send(AskPosition())

    def pause(self) -> None:
        """Pause the physics.

        Raises:
            DeviceError: X-Plane does not say that they rest.
        """
        if not self._pause.confirmed(PAUSE_S):
            raise DeviceError(
                f"{self._address}: {PAUSE_S:g} s of PAUSE were not confirmed{self._refusal}. {HINT}"
            )

    def check(self, silent_s: float) -> None:
        """Look whether answers come to what is asked; does not wait.

        Raises:
            DeviceError: None came for `silent_s` [s].
        """
        silent = time.monotonic() - self._answered_s
        if silent > silent_s:
            raise DeviceError(f"{self._address}: no answer for {silent:.1f} s{self._refusal}. {HINT}")

    def close(self) -> None:
        """Close it."""
        self._reader.stop()

    def _take(self, data: bytes) -> None:
        try:
            answer = decode(data)
        except MalformedError as error:
            self._refusal = f"; what came: {error}"
            return
        if isinstance(answer, Values):
            self._pause.take(answer)
        elif isinstance(answer, Position):
            self._refusal, self._answered_s = "", time.monotonic()
            self._answered.set()

    def _end(self, reason: str) -> None:
        self._refusal = f"; {reason}"
