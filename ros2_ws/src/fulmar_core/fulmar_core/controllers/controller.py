"""What a controller is: a function from a task's observation to an actuator command."""

from __future__ import annotations

from typing import Any, Protocol

from fulmar_core.rotation import Array


class Controller(Protocol):
    """One interface for learned and classical controllers, on the robot and in evaluation."""

    name: str
    observation_names: tuple[str, ...]
    control_hz: float

    def reset(self) -> None:
        """Forget everything about the past: a new goal, a new episode, or time jumped."""
        ...

    def act(self, observation: Array) -> Array:
        """Choose a command.

        A controller that remembers anything does so for each row by itself, until `reset` or another number of rows.

        Args:
            observation: Terms in the order of `observation_names`, shape (n,) or (worlds, n).

        Returns:
            One value for each actuator, in the robot's order, shape (m,) or (worlds, m).
        """
        ...

    def metadata(self) -> dict[str, Any]:
        """Who this is, as JSON-ready values with a `sha256` of whatever defines its behaviour."""
        ...
