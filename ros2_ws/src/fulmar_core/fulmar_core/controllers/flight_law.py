"""What the laws of aircraft have in common: craft, believed state, limits that cut, and thrust of the motors."""

from __future__ import annotations

import functools
from dataclasses import asdict
from typing import Any

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.flight_observer import FlightObserver, ObserverNoise
from fulmar_core.controllers.law import Law
from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces
from fulmar_core.robots.airframe.atmosphere import SEA_LEVEL
from fulmar_core.states.spatial import SpatialState


class FlightLaw(Law):
    """A law that flies an aircraft."""

    def fly(self) -> None:
        """Prepare for the robot; call first in `bind`.

        Raises:
            ValueError: The robot is no aircraft.
        """
        self._craft = self.robot.actuated_by(ControlSurfaces)
        self._speed = self.robot.wings.speed
        self._dt = self.robot.timing.substeps(self.control_hz) * self.robot.timing.physics_dt

    def believe(self, noise: ObserverNoise | None, *, any_heading: bool = False) -> None:
        """Believe states of a `FlightObserver`, whose arguments these are, or, without noise, as measured."""
        self.observer = (
            None if noise is None else FlightObserver(self.robot, noise, self._dt, any_heading=any_heading)
        )

    def derived(self) -> dict[str, Any]:
        """See `Law.derived`; gains and observer follow from the aerodynamics and the sensors, aims from the task."""
        own: dict[str, Any] = {"airframe": self.robot.airframe, "odometry": self.robot.sensors.odometry}
        return super().derived() | {name: asdict(part) for name, part in (own | {"task": self.task}).items()}

    def reset(self) -> None:
        """Forget the past."""
        super().reset()
        if self.observer is not None:
            self.observer.reset()

    def believed(self, inputs: Inputs) -> SpatialState:
        """The believed state of n craft."""
        state: SpatialState = inputs.state if inputs.believed is None else inputs.believed
        return state

    def saturated(self, command: np.ndarray) -> np.ndarray:
        """Whether limits cut commands (n, m) of ailerons, elevators and motors, shape (n, 3): integrals rest there."""
        cut, names = np.abs(self._craft.limited(command) - command) > 0.0, self._craft.names
        none = np.zeros(len(cut), dtype=bool)
        roll, pitch = (
            cut[:, names.index(name)] if name in names else none for name in ("aileron", "elevator")
        )
        return np.stack((roll, pitch, cut[:, self._craft.positions :].any(axis=1)), axis=-1)

    @functools.cached_property
    def thrust_slope(self) -> float:
        """Thrust of all motors per throttle at the cruising speed and sea level [N]."""
        at, density = np.array([self._speed]), np.array([SEA_LEVEL])
        total = 0.0
        for motor in self._craft.motors:
            low, high = (float(motor.engine.thrust_at(np.array([t]), at, density)[0]) for t in (0.3, 0.5))
            total += (high - low) / 0.2
        return total
