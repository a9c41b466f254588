"""Pauses X-Plane, and looks whether it is: a datagram alone may be lost, and the aircraft flies on."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable

from hardware_drivers.xplane_messages import PAUSE, AskReferences, Message, Simulation, Values

# What the plugin sets at SIMU: of each aircraft, whether its physics rest. The user's own is the first.
RESTS = "sim/operation/override/override_planepath"
AGAIN_S = 0.03  # what has no answer for so long is sent again


class Pause:
    """Sends PAUSE until X-Plane says that its physics rest."""

    def __init__(self, send: Callable[[Message], None]) -> None:
        """Prepare; `send` may raise OSError, as where a datagram is lost."""
        self._send, self._rests = send, threading.Event()

    def take(self, values: Values) -> bool:
        """Take an answer, from the reading thread; whether it is one to our question: no other asks for one value."""
        if len(values.values) != 1:
            return False
        if any(values.values[0][:1]):
            self._rests.set()
        return True

    def confirmed(self, within_s: float) -> bool:
        """Pause; whether that is confirmed within some time [s]."""
        until = time.monotonic() + within_s
        self._rests.clear()
        while True:
            with contextlib.suppress(OSError):
                self._send(Simulation(PAUSE))
                self._send(AskReferences((RESTS,)))
            if self._rests.wait(AGAIN_S):
                return True
            if time.monotonic() > until:
                return False
