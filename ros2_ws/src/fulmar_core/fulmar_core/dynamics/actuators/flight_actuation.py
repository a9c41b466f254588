"""What servos, motors and gusts of a batch of aircraft remember."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from array_api_compat import device

from fulmar_core.dynamics.actuators.actuation import ActuationState
from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces
from fulmar_core.robots.sensors.surfaces import NAME, SurfacePositions
from fulmar_core.states.arrays import array_namespace, clip, is_single
from fulmar_core.states.rotation import Array
from fulmar_core.worlds.turbulence import FILTERS, Gust, gust_step


class FlightActuation(ActuationState):
    """Servos of second order and motors with a lag; `applied` has deflections [rad] and thrust levels.

    The air is part of it: gusts are the one thing around a body that remembers.

    Attributes:
        servo_rates: How fast each surface moves, shape (surfaces, worlds) [rad/s].
        gusts: Memory of the turbulence, shape (FILTERS, worlds).
        gust_steps: Steps that the turbulence of each world has made, shape (worlds,).
    """

    FROM_ZERO = (*ActuationState.FROM_ZERO, "servo_rates", "gust_steps")
    MUTABLE = (*ActuationState.MUTABLE, "servo_rates", "gusts", "gust_steps")

    def __init__(self, actuators: ControlSurfaces, safe: Array, **kwargs: Any) -> None:
        """Begin in the safe state, in still air; arguments as in `ActuationState`, and nothing opens late."""
        super().__init__(actuators, safe, **{**kwargs, "opens_late": False})
        self._actuators, self._count = actuators, actuators.positions
        xp, worlds = array_namespace(safe), safe.shape[1]
        self._kwargs = {"dtype": safe.dtype, "device": device(safe)}
        self.servo_rates: Array = 0.0 * safe[: self._count]
        self.gusts: Array = xp.zeros((FILTERS, worlds), **self._kwargs)
        self.gust_steps: Array = xp.zeros((worlds,), dtype=xp.int64, device=device(safe))
        self._most = xp.asarray(actuators.scale[: self._count, None], **self._kwargs)
        fastest = np.where(np.isfinite(actuators.rates), actuators.rates, 1e6)
        self._fastest = xp.asarray(fastest[:, None], **self._kwargs)
        self._limits = fastest.tolist(), actuators.scale[: self._count].tolist()
        self._servo: dict[float, tuple[float, ...]] = {}

    def truths(self) -> dict[str, Any]:
        """Where surfaces and throttles are; see `ActuationState.truths`."""
        return {NAME: SurfacePositions(self._actuators.names, np.asarray(self.applied[:, 0], dtype=float))}

    def hold(self, command: Array) -> None:
        """Let every actuator stand where a command asks for, at rest, shape (n, worlds)."""
        super().hold(command)
        self.servo_rates = 0.0 * command[: self._count]

    def advance(self, dt: float, *, latest_s: float) -> Array:
        """Let servos and motors follow for a time step; see `ActuationState.advance`.

        Returns:
            Deflections and thrust levels in the middle of the step, shape (n, worlds).
        """
        target = self._target(dt, latest_s=latest_s)
        xp, count, before = array_namespace(target), self._count, self.applied
        if dt not in self._servo:
            self._servo[dt] = tuple(self._actuators.servo_matrix(dt).ravel().tolist())
        servo = self._servo[dt]
        if is_single(target[0]):
            now, wanted = before[:, 0].tolist(), target[:, 0].tolist()
            own = zip(now, wanted, self.servo_rates[:, 0].tolist(), *self._limits, strict=False)
            moved = [_turned(*each, servo, dt) for each in own]
            self.servo_rates = np.array([[rate] for _, rate in moved]).reshape(count, 1)
            levels = self._levels(now, wanted, dt)
            self.applied = np.array([*(place for place, _ in moved), *levels])[:, None]
        else:
            place, self.servo_rates = _turned(
                before[:count], target[:count], self.servo_rates, self._fastest, self._most, servo, dt
            )
            levels = self._levels(before, target, dt)
            self.applied = xp.concat((place, xp.stack(levels))) if levels else place
        return 0.5 * (before + self.applied)

    def _levels(self, before: Any, target: Any, dt: float) -> list[Any]:
        """Thrust levels of the motors after a time step, of what all actuators did and are to do."""
        levels = []
        for i, motor in enumerate(self._actuators.motors, start=self._count):
            keep = math.exp(-dt / motor.lag_s) if motor.lag_s > 0.0 else 0.0
            levels.append(target[i] + keep * (before[i] - target[i]))
        return levels

    def blow(
        self, keys: Array, wind: Array, *, airspeed: Array, height: Array, span: float, dt: float
    ) -> Gust:
        """Let the air move past for a time step; arguments and result as in `turbulence.gust_step`."""
        self.gusts, gust = gust_step(
            self.gusts, keys, self.gust_steps, airspeed=airspeed, height=height, wind=wind, span=span, dt=dt
        )
        self.gust_steps = self.gust_steps + 1
        return gust


def _turned(
    before: Any, target: Any, rate: Any, fastest: Any, most: Any, servo: tuple[float, ...], dt: float
) -> tuple[Any, Any]:
    """Where surfaces are after a time step, and how fast they move; of arrays, or of one surface in plain numbers."""
    off = before - target
    place = target + servo[0] * off + servo[1] * rate
    rate = clip(servo[2] * off + servo[3] * rate, -fastest, fastest)
    place = clip(place, before - dt * fastest, before + dt * fastest)
    stopped = clip(place, -most, most)
    xp = array_namespace(rate)
    return stopped, xp.where(stopped == place, rate, xp.zeros_like(rate))
