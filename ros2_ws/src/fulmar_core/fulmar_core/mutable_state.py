"""What of an object steps change: to be copied, to be resumed from, or to be lent to another library's arrays."""

from __future__ import annotations

from typing import Any, ClassVar


class MutableState:
    """Something that steps, and tells by name what they change: arrays, what is made of arrays, and numbers."""

    MUTABLE: ClassVar[tuple[str, ...]]

    def mutable_state(self) -> dict[str, Any]:
        """Everything that steps change, by name; not copied."""
        return {name: getattr(self, name) for name in self.MUTABLE}

    def take(self, moving: dict[str, Any]) -> None:
        """Go on from what `moving` told of one that was built alike; not copied."""
        for name in self.MUTABLE:
            setattr(self, name, moving[name])
