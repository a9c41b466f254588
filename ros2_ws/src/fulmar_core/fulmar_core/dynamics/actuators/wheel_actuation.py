"""Between commands and what reaction wheels do: as every actuator, with the speeds of the wheels as its memory."""

from __future__ import annotations

from typing import Any

from fulmar_core.dynamics.actuators.actuation import ActuationState
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.rotation import Array


class WheelActuation(ActuationState):
    """What the wheels of a batch of worlds do now; `applied` has the torques that are asked of motors and unloading.

    Attributes:
        speeds: Of each wheel relative to the body, shape (count, worlds) [rad/s].
    """

    MUTABLE = (*ActuationState.MUTABLE, "speeds")

    def __init__(self, *args: Any, count: int, **kwargs: Any) -> None:
        """Begin with wheels at rest; `count` wheels, the rest as of `ActuationState`."""
        super().__init__(*args, **kwargs)
        self.speeds: Array = 0.0 * self.applied[:count]

    def reset(self, which: Array, safe: Array) -> None:
        """Bring some worlds back to the safe state, wheels at rest; arguments as of `ActuationState.reset`."""
        super().reset(which, safe)
        speeds = array_namespace(safe).asarray(self.speeds, copy=True)
        speeds[:, which] = 0.0
        self.speeds = speeds
