"""Between commands and what thrusters do that a tank feeds: as every actuator, with the gas that is gone as memory."""

from __future__ import annotations

from typing import Any

import numpy as np

from fulmar_core.dynamics.actuators.actuation import ActuationState
from fulmar_core.robots.actuators.family import Actuators
from fulmar_core.robots.sensors.fuel import NAME as FUEL
from fulmar_core.robots.sensors.fuel import fuel_of
from fulmar_core.robots.sensors.supply import NAME
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.rotation import Array
from fulmar_core.worlds.world import World


class TankActuation(ActuationState):
    """What the valves of a batch of worlds do now; thrust follows the pressure at the beginning of a control step."""

    FROM_ZERO = (*ActuationState.FROM_ZERO, "_fallen")
    MUTABLE = (*ActuationState.MUTABLE, "_filled", "_fallen", "_share")

    def __init__(self, actuators: Actuators, safe: Array, *, world: World, **kwargs: Any) -> None:
        """Begin with full tanks, or with less as the worlds say; the rest as in `ActuationState`."""
        super().__init__(actuators, safe, **kwargs)
        assert actuators.tank is not None
        self._actuators, self._tank = actuators, actuators.tank
        self._filled: Array = world.tank_fill
        self._strength: Array | float = 1.0
        self._fallen: Array = array_namespace(self.applied).zeros_like(
            self.applied[0]
        )  # since the start [Pa]
        self._share = self._tank.share(self.pressure)

    @property
    def pressure(self) -> Array:
        """In each tank, shape (worlds,) [Pa]."""
        return clip(self._tank.pressure * self._filled - self._fallen, 0.0, None)

    @property
    def lost(self) -> Array | None:
        """What was blown out, or missed at the start; see `ActuationState.lost`."""
        return self._tank.gone(self.pressure) if self._tank.weighs else None

    @property
    def fuel_share(self) -> Array | None:
        """By the pressure of an ideal gas; see `ActuationState.fuel_share`."""
        return self.pressure / self._tank.pressure

    @property
    def readings(self) -> dict[str, np.ndarray]:
        """Pressure and content of the tanks; see `ActuationState.readings`."""
        pressure = np.asarray(self.pressure, dtype=float)
        left = self._tank.left(pressure)
        return {NAME: pressure[:, None], FUEL: np.stack((left, left / self._tank.content), axis=-1)}

    def truths(self) -> dict[str, Any]:
        """Pressure and content of the tank; see `ActuationState.truths`."""
        pressure = float(self.pressure[0])
        return {NAME: pressure, FUEL: fuel_of(self._tank.left(pressure), self._tank.content)}

    def begin(self, command: Array, world: World, noise: Array | None) -> None:
        """Take a new command; see `ActuationState.begin`."""
        super().begin(command, world, noise)
        self._filled, self._strength = world.tank_fill, world.strength
        self._share = self._tank.share(self.pressure)
        self.gain = self.gain * self._share

    def advance(self, dt: float, *, latest_s: float) -> Array:
        """Let time pass, and gas flow; see `ActuationState.advance`."""
        applied = super().advance(dt, latest_s=latest_s)
        thrust = self._actuators.total_thrust(applied) * self._share * self._strength
        self._fallen = self._fallen + self._tank.fall(thrust) * dt
        return applied
