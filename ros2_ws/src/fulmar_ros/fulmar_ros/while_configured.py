"""Callbacks of a lifecycle node that count while it is configured."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Concatenate, ParamSpec, Protocol, TypeVar


class Configured(Protocol):
    """A node that owns its guard while it is configured."""

    @property
    def guard(self) -> object | None:
        """None: it is not configured."""


_Node = TypeVar("_Node", bound=Configured)
_Given = ParamSpec("_Given")


def while_configured(
    receive: Callable[Concatenate[_Node, _Given], None],
) -> Callable[Concatenate[_Node, _Given], None]:
    """Leave out what comes after a shutdown: the EventsExecutor still delivers what a destroyed endpoint has received.

    Args:
        receive: A method of the node.
    """

    @functools.wraps(receive)
    def receive_while_configured(self: _Node, /, *args: _Given.args, **more: _Given.kwargs) -> None:
        if self.guard is not None:
            receive(self, *args, **more)

    return receive_while_configured
