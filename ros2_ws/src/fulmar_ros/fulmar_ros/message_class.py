"""The class of a wire's messages, by the name of its type."""

from __future__ import annotations

import importlib
from typing import Any

from fulmar_core.config.errors import ConfigError
from fulmar_core.wires.wire import Wire


def needed_class(wire: Wire) -> Any:
    """The class of a wire's messages.

    Raises:
        ConfigError: There is no such type here.
    """
    found = message_class(wire)
    if found is None:
        package = wire.type.partition("/")[0]
        raise ConfigError(
            f"topic '{wire.name}': there is no message type {wire.type} here. Is the ROS package '{package}' installed?"
        )
    return found


def message_class(wire: Wire) -> Any:
    """The class of a wire's messages; None where there is none, as its package is not installed."""
    package, kind, name = wire.type.split("/")
    try:
        return getattr(importlib.import_module(f"{package}.{kind}"), name)
    except (ModuleNotFoundError, AttributeError):
        return None
