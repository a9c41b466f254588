"""The class of a wire's messages, by the name of its type."""

from __future__ import annotations

import importlib
from typing import Any

from fulmar_core.wires.wire import Wire


def message_class(wire: Wire) -> Any:
    """The class of a wire's messages; None where the package of a foreign one is not installed."""
    package, kind, name = wire.type.split("/")
    try:
        return getattr(importlib.import_module(f"{package}.{kind}"), name)
    except ModuleNotFoundError:
        return None
