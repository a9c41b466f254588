"""What the laws have in common that fly aircraft along a reference: its aim, commands of level flight, departures."""

from __future__ import annotations

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.flight_law import FlightLaw
from fulmar_core.controllers.flight_observer import ObserverNoise
from fulmar_core.controllers.flight_reference import Aim, SmoothReference
from fulmar_core.dynamics.flight_schedule import Schedule
from fulmar_core.states.arrays import array_namespace, is_single, side_by_side
from fulmar_core.states.attitude import from_euler, product, rotation_error
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks.follow_reference import FollowReference


class FlightFollowing(FlightLaw):
    """A law that flies an aircraft along a reference that is known ahead."""

    def follow(self, *, smooth_s: float, observer: ObserverNoise | None) -> None:
        """Prepare for robot and task; arguments as in `FlightWeights`.

        Raises:
            ValueError: The robot is no aircraft, or the task has no reference.
        """
        self.fly()
        if not isinstance(self.task, FollowReference):
            raise ValueError(f"the law follows references, and '{self.task.name}' has none.")
        self._reference = SmoothReference(self.task, over_s=smooth_s, dt=self._dt)
        self.believe(observer)

    def reset(self) -> None:
        """Forget the past."""
        super().reset()
        self._reference.reset()

    def see(self, inputs: Inputs) -> tuple[Aim, SpatialState]:
        """The aim of now and the believed state, of n craft."""
        return self._reference.at(inputs), self.believed(inputs)

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
        (drift, climb), (aside, up), quat = aim.rate.T, aim.bend.T, schedule.quat(state.z).T
        if is_single(state.x):
            state, quat = state.in_numbers(), quat[:, 0].tolist()
            drift, climb, aside, up = (float(part[0]) for part in (drift, climb, aside, up))
        speed = self._speed
        heading, rise, bank = array_namespace(drift).atan2(drift, speed), -climb / speed, -aside / GRAVITY
        aimed = product(from_euler(bank, rise, heading), tuple(quat))
        turned = rotation_error(aimed, state.quat)
        velocity = state.vx - speed, state.vy - drift, state.vz - climb
        rates = state.wx, state.wy + up / speed, state.wz - aside / speed
        return np.asarray(side_by_side(*turned, *velocity, *rates).reshape(len(aim.rate), -1))
