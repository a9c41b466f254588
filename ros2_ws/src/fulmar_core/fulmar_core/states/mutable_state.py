"""The mutable state of a simulation, for copying and checkpoints."""

from __future__ import annotations

from typing import Any, ClassVar


class MutableState:
    """Something that steps; `MUTABLE` names what steps change: arrays, what is made of arrays, and numbers."""

    MUTABLE: ClassVar[tuple[str, ...]]

    def mutable_state(self) -> dict[str, Any]:
        """Everything that steps change, by name; not copied."""
        return {name: getattr(self, name) for name in self.MUTABLE}

    def take(self, state: dict[str, Any]) -> None:
        """Go on from the `mutable_state` of another one that was built alike; not copied."""
        for name in self.MUTABLE:
            setattr(self, name, state[name])
