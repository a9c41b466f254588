"""What the laws of aircraft have in common: the smoothed reference, the believed state, commands of level flight."""

from __future__ import annotations

import functools
from dataclasses import asdict
from typing import Any

import numpy as np

from fulmar_core.actuators.control_surfaces import ControlSurfaces
from fulmar_core.attitude import from_euler, product, rotation_error
from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.flight_observer import FlightObserver, ObserverNoise
from fulmar_core.controllers.flight_reference import Aim, SmoothReference
from fulmar_core.controllers.law import Law
from fulmar_core.dynamics.hydrodynamics import GRAVITY
from fulmar_core.flight.schedule import Schedule
from fulmar_core.spatial import SpatialState
from fulmar_core.tasks.follow_reference import FollowReference


class FlightLaw(Law):
    """A law that flies an aircraft along a reference that is known ahead."""

    def follow(self, *, smooth_s: float, observer: ObserverNoise | None) -> None:
        """Prepare for robot and task; arguments as of `FlightWeights`.

        Raises:
            ValueError: The robot is no aircraft, or the task has no reference.
        """
        if not isinstance(self.robot.actuators, ControlSurfaces) or self.robot.airframe is None:
            raise ValueError("the law flies aircraft; this robot is none.")
        if not isinstance(self.task, FollowReference):
            raise ValueError(f"the law follows references, and '{self.task.name}' has none.")
        self._craft = self.robot.actuators
        self._speed = self.robot.airframe.speed
        self._dt = self.robot.timing.substeps(self.control_hz) * self.robot.timing.physics_dt
        self._reference = SmoothReference(self.task, over_s=smooth_s, dt=self._dt)
        self._observer = None if observer is None else FlightObserver(self.robot, observer, self._dt)

    def derived(self) -> dict[str, Any]:
        """See `Law.derived`; gains and observer follow from the aerodynamics and the sensors, aims from the task."""
        own: dict[str, Any] = {"airframe": self.robot.airframe, "odometry": self.robot.sensors.odometry}
        return super().derived() | {name: asdict(part) for name, part in (own | {"task": self.task}).items()}

    def reset(self) -> None:
        """Forget the past."""
        super().reset()
        self._reference.reset()
        if self._observer is not None:
            self._observer.reset()

    def see(self, inputs: Inputs) -> tuple[Aim, SpatialState]:
        """The aim of now and the believed state, of n craft."""
        aim, state = self._reference.at(inputs), inputs.state
        assert isinstance(state, SpatialState)
        if self._observer is not None:
            state = self._observer.update(state, inputs)
        return aim, state

    def level(self, schedule: Schedule, aim: Aim) -> np.ndarray:
        """Commands of level flight where n craft shall be, with the thrust that a climb takes, shape (n, m)."""
        command = schedule.command(aim.place[:, 1])
        thrust = self.robot.body.mass * GRAVITY * aim.rate[:, 1] / self._speed
        command[:, self._craft.positions :] += (thrust / self.thrust_slope)[:, None]
        return command

    def motion(self, schedule: Schedule, state: SpatialState, aim: Aim) -> np.ndarray:
        """Departures from what an aim takes, shape (n, 9): rotation [rad], velocity [m/s] and turn rate [rad/s].

        A climb takes pitch, a drift heading, and a bend bank.
        """
        (drift, climb), bend, speed = aim.rate.T, aim.bend, self._speed
        heading, rise, bank = np.arctan2(drift, speed), -climb / speed, -bend[:, 0] / GRAVITY
        aimed = product(from_euler(bank, rise, heading), tuple(schedule.quat(state.z).T))
        turned = rotation_error(aimed, state.quat)
        velocity = state.vx - speed, state.vy - drift, state.vz - climb
        rates = state.wx, state.wy + bend[:, 1] / speed, state.wz - bend[:, 0] / speed
        return np.stack((*turned, *velocity, *rates), axis=-1)

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
        """Thrust of all motors per throttle at the cruising speed [N]."""
        at, density = np.array([self._speed]), np.array([1.225])
        total = 0.0
        for motor in self._craft.motors:
            low, high = (float(motor.engine.thrust_at(np.array([t]), at, density)[0]) for t in (0.3, 0.5))
            total += (high - low) / 0.2
        return total
