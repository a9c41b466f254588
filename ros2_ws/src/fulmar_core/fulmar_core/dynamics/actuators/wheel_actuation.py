"""Between commands and what reaction wheels do: as every actuator, with the speeds of the wheels as its memory."""

from __future__ import annotations

from typing import Any

import numpy as np

from fulmar_core.dynamics.actuators.actuation import ActuationState
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.sensors.wheels import NAME, WheelSpeeds
from fulmar_core.states.rotation import Array


class WheelActuation(ActuationState):
    """What the wheels of a batch of worlds do now; `applied` has the torques that are asked of motors and unloading.

    Attributes:
        speeds: Of each wheel relative to the body, shape (count, worlds) [rad/s].
    """

    FROM_ZERO = (*ActuationState.FROM_ZERO, "speeds")
    MUTABLE = (*ActuationState.MUTABLE, "speeds")

    def __init__(self, actuators: ReactionWheels, safe: Array, **kwargs: Any) -> None:
        """Begin with wheels at rest; arguments as in `ActuationState`."""
        super().__init__(actuators, safe, **kwargs)
        self._names = actuators.wheel_names
        self.speeds: Array = 0.0 * self.applied[: actuators.count]

    @property
    def readings(self) -> dict[str, np.ndarray]:
        """Speeds of the wheels; see `ActuationState.readings`."""
        return {NAME: np.asarray(self.speeds, dtype=float).T}

    def truths(self) -> dict[str, Any]:
        """Speeds of the wheels; see `ActuationState.truths`."""
        return {NAME: WheelSpeeds(self._names, self.readings[NAME][0])}
