"""Pure pursuit for cars.

Coulter, "Implementation of the pure pursuit path tracking algorithm", CMU-RI-TR-92-01, 1992: the car drives
on the circle that leads from its rear axle to a point on its path, of curvature 2 y / L² for a point at (x,
y), L away; here the path is the straight line to the goal, and the point is a look-ahead distance away or the
goal itself. The same circle is driven astern to goals behind. The speed is what the goal, the next corner and
the tyres allow: v² |curvature| <= a sideways.

A goal beside the car, inside its tightest circles, is on none that it can drive. It drives straight on, the
way that it moves, until it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.controllers.body_frame import Vector
from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.guidance import (
    bearing,
    end_that_goes_first,
    stopping_speed,
    way_to_face,
)
from fulmar_core.controllers.planar_law import PlanarLaw
from fulmar_core.robots.actuators.ackermann import Ackermann


@dataclass(frozen=True)
class PurePursuitGains:
    """Gains, as read from `configs/controllers/<robot>_pure_pursuit.yaml`."""

    look_ahead: float  # [m]
    cruise: float  # fastest speed towards a goal [m/s]
    approach: float  # speed for each metre that is left [1/s]
    braking: float  # deceleration to plan with [m/s²]
    sideways: float  # acceleration that the tyres may be asked for [m/s²]
    corner: float  # share of the cruising speed at a waypoint where the path turns by a quarter or more [-]
    near: float  # what counts as there [m]
    velocity: float  # share of an error of the wanted speed that the command adds [-]
    speed_around: float  # fastest among obstacles, as a share of the speed where nothing stands about [-]

    def __post_init__(self) -> None:
        positive = (
            self.look_ahead, self.cruise, self.approach, self.braking, self.sideways, self.near, self.speed_around,
        )  # fmt: skip
        if min(positive) <= 0.0 or self.corner < 0.0 or not 0.0 <= self.velocity < 1.0:
            raise ValueError("gains must be greater than 0; 'corner' not negative, 'velocity' in [0, 1).")


class PurePursuit(PlanarLaw):
    """Drives to positions, through waypoints, and at velocities."""

    law = "pure_pursuit"
    title = "pure pursuit"
    gains: PurePursuitGains

    def command(self, inputs: Inputs) -> np.ndarray:
        """Speed and steering angle; shapes as in `Controller.act`."""
        u, _, _ = self.frame.motion(inputs)
        if self.frame.tracks:
            speed, _, turn = self.frame.wanted_motion(inputs)
            return self._at_velocity(speed, turn, u)
        goal = self.frame.goal(inputs)
        room = self.room(inputs, end_that_goes_first(u))
        last = self.last_speed(goal, inputs, cruise=self.gains.cruise)
        return self._pursuit(goal, u, room, last)

    def _pursuit(self, goal: Vector, u: np.ndarray, room: np.ndarray, last: np.ndarray) -> np.ndarray:
        gains = self.gains
        rho = np.hypot(*goal)
        way = way_to_face(goal, u, backwards=True)
        alpha = bearing(goal, way)
        # An angle to the left of the end that goes first is steered to the left going ahead, to the right going astern.
        direct = 2.0 * np.sin(alpha) / np.maximum(rho, 1e-6)
        sharp = 2.0 * np.sin(alpha) / np.clip(rho, 1e-6, gains.look_ahead)
        beside = np.abs(direct) > self._tightest
        curvature = np.where(beside, 0.0, np.clip(sharp, -self._tightest, self._tightest))
        fastest = stopping_speed(
            np.minimum(rho, room), gain=gains.approach, deceleration=gains.braking, last=last
        )
        held = np.sqrt(gains.sideways / np.maximum(np.abs(curvature), 1e-3))
        speed = np.minimum(np.minimum(fastest, held), gains.cruise * self.share_of_speed)
        way = np.where(beside & (np.abs(u) > 0.01), np.sign(u), way)
        driven = np.stack((way * speed, way * np.arctan(self._car.wheelbase * curvature)), axis=-1)
        moving = (rho > self.near) | (last > 0.0)
        return np.where(moving[..., None], driven, 0.0)

    def _at_velocity(self, speed: np.ndarray, turn: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Steering for a turn rate r at speed u: tan(angle) = wheelbase r / u (Rajamani 2012, §2.2).

        A car turns no faster than its tightest circle allows at its speed. Where that is less than wanted, it drives
        faster, until both errors are the same share of what the task tolerates.
        """
        tolerance, k = self.task.tolerance, self._tightest
        much, much_turn = tolerance.velocity, np.deg2rad(tolerance.yaw_rate_deg)
        shared = (much_turn * np.abs(speed) + much * np.abs(turn)) / (much_turn + much * k)
        sign = np.where(speed < 0.0, -1.0, 1.0)
        speed = sign * np.where(np.abs(turn) > k * np.abs(speed), shared, np.abs(speed))
        curvature = np.clip(turn / np.where(np.abs(speed) > 1e-6, speed, 1e-6), -k, k)
        steering = np.arctan(self._car.wheelbase * curvature)
        return np.stack((speed + self.gains.velocity * (speed - u), steering), axis=-1)

    @property
    def _car(self) -> Ackermann:
        return self.robot.actuated_by(Ackermann)

    @property
    def _tightest(self) -> float:
        """Largest curvature that the front wheels steer [1/m]."""
        return float(np.tan(self._car.max_steering) / self._car.wheelbase)
