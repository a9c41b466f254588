"""Wires of a plant that lead nowhere."""

from __future__ import annotations

import time
from contextlib import nullcontext
from types import SimpleNamespace


def quiet_wires():
    """What a loop needs of wires; what it publishes is lost, and no command comes."""
    return SimpleNamespace(
        lock=nullcontext(),
        publish_sample=lambda *_: None,
        publish_applied=lambda *_: None,
        commands=SimpleNamespace(take_arrived=lambda: None, steady_ns=time.monotonic_ns()),
    )
