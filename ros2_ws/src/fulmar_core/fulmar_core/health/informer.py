"""Controllers that want to know the health of the actuators are told before each step, on ROS and in evaluation."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np

from fulmar_core.controllers.controller import Controller
from fulmar_core.health.applied import Applied
from fulmar_core.health.thruster_health import Health, ThrusterHealth, can_be_watched
from fulmar_core.planar import PlanarState
from fulmar_core.robot import Robot


@runtime_checkable
class Informed(Protocol):
    """A controller that listens; `Controller` itself does not ask for it."""

    def inform(self, health: Health) -> None:
        """Hear what is believed of the actuators, right before `act`; shapes as there."""
        ...


class Informer:
    """The estimator beside a controller; costs nothing where nobody wants to know."""

    def __init__(self, robot: Robot, controller: Controller) -> None:
        """Look whether this robot can be watched, and whether the controller listens."""
        self._health = ThrusterHealth(robot) if can_be_watched(robot) else None
        self._listener = controller if isinstance(controller, Informed) else None

    @property
    def listens(self) -> bool:
        """Whether the controller wants to know."""
        return self._listener is not None

    def reset(self) -> None:
        """Forget everything: time jumped, or a new episode began."""
        if self._health is not None:
            self._health.reset()

    def see(
        self, measured: PlanarState, applied: np.ndarray | Applied | None, dt: float, *, wanted: bool = False
    ) -> Health | None:
        """Take a measurement, and tell the controller.

        Args:
            measured: Odometry now, shapes (...,).
            applied: What was applied since the last measurement, as in `ThrusterHealth.see`.
            dt: How long that was [s].
            wanted: Whether somebody else wants to know as well.

        Returns:
            What is believed; None where nobody wants to know, or nobody can.
        """
        if self._health is None or not (wanted or self._listener):
            return None
        health = self._health.see(measured, applied, dt)
        if self._listener is not None:
            self._listener.inform(health)
        return health
