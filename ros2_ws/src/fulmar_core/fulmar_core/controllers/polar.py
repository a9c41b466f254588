"""Polar-coordinate law for differential drives.

Astolfi, "Exponential stabilization of a wheeled mobile robot via discontinuous control", J. Dyn. Sys. Meas.
Control 121, 1999, in the form of Siegwart and Nourbakhsh, "Introduction to Autonomous Mobile Robots", MIT
Press 2004, §3.6.2: with the distance rho to the goal, its bearing alpha, and beta, how far the way to the
goal still turns afterwards, v = k_rho rho and omega = k_alpha alpha + k_beta beta drive all three to zero if
k_rho > 0, k_beta < 0 and k_alpha + 5/3 k_beta - 2/pi k_rho > 0. Where only a position counts, beta has no
part. What is left of the heading at the goal is turned off on the spot.
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
from fulmar_core.robots.actuators.differential_drive import DifferentialDrive


@dataclass(frozen=True)
class PolarGains:
    """Gains, as read from `configs/controllers/<robot>_polar.yaml`."""

    distance: float  # k_rho [1/s]
    bearing: float  # k_alpha [1/s]
    heading: float  # k_beta, negative [1/s]
    turn: float  # of the turn on the spot [1/s]
    near: float  # what counts as there [m]
    slowing: float  # speed to a position falls with this power of the cosine of its bearing [-]
    corner: float  # share of top speed at a waypoint where the path turns by a quarter or more [-]
    velocity: float  # share of a velocity error that the command adds [-]
    speed_around: float  # fastest among obstacles, as a share of the speed where nothing stands about [-]

    def __post_init__(self) -> None:
        positive = (self.distance, self.bearing, self.turn, self.near, self.slowing, self.speed_around)
        if min(positive) <= 0.0 or self.heading >= 0.0:
            raise ValueError("all gains must be greater than 0, 'heading' less than 0.")
        if self.bearing + 5.0 / 3.0 * self.heading - 2.0 / np.pi * self.distance <= 0.0:
            raise ValueError("'bearing' + 5/3 'heading' - 2/pi 'distance' must be greater than 0 (§3.6.2).")
        if not 0.0 <= self.velocity < 1.0 or self.corner < 0.0:
            raise ValueError("'velocity' must lie in [0, 1), 'corner' must not be negative.")


class Polar(PlanarLaw):
    """Drives to poses, to positions, through waypoints, and at velocities."""

    law = "polar"
    title = "polar law"
    gains: PolarGains

    def command(self, inputs: Inputs) -> np.ndarray:
        """Speed and turn rate; shapes as in `Controller.act`."""
        if self.frame.tracks:
            return self._at_velocity(inputs)
        u, _, _ = self.frame.motion(inputs)
        goal = self.frame.goal(inputs)
        if self.frame.heads:
            return self._to_pose(goal, self.frame.turn(inputs), u)
        room = self.room(inputs, end_that_goes_first(u))
        last = self.last_speed(goal, inputs, cruise=self._drive.max_speed)
        return self._to_position(goal, u, room, last)

    def _at_velocity(self, inputs: Inputs) -> np.ndarray:
        """What is wanted, and a share of what is missing."""
        u, _, r = self.frame.motion(inputs)
        wanted_u, _, wanted_r = self.frame.wanted_motion(inputs)
        k = 1.0 + self.gains.velocity
        return np.stack((u + k * (wanted_u - u), r + k * (wanted_r - r)), axis=-1)

    def _to_position(self, goal: Vector, u: np.ndarray, room: np.ndarray, last: np.ndarray) -> np.ndarray:
        top, fastest_turn = self._drive.scale * (self.share_of_speed, 1.0)
        rho = np.hypot(*goal)
        way = way_to_face(goal, u, backwards=True)
        alpha = bearing(goal, way)
        to_go = np.minimum(rho, room)
        fastest = stopping_speed(to_go, gain=self.gains.distance, deceleration=self._braking, last=last)
        speed = np.minimum(fastest, top) * np.maximum(np.cos(alpha), 0.0) ** self.gains.slowing
        turn = np.clip(self.gains.bearing * alpha, -fastest_turn, fastest_turn)
        moving = (rho > self.near) | (last > 0.0)
        return np.where(moving[..., None], np.stack((way * speed, turn), axis=-1), 0.0)

    def _to_pose(self, goal: Vector, heading: np.ndarray, u: np.ndarray) -> np.ndarray:
        most = self._drive.scale
        rho = np.hypot(*goal)
        way = way_to_face(goal, u, backwards=True)
        alpha = bearing(goal, way)
        beta = np.arctan2(np.sin(heading - alpha), np.cos(heading - alpha))
        speed, rate = self.gains.distance * rho, self.gains.bearing * alpha + self.gains.heading * beta
        go = np.stack((way * speed, rate), axis=-1)
        go = go / np.maximum(np.max(np.abs(go) / most, axis=-1, keepdims=True), 1.0)  # slower, same path
        turn = np.stack((0.0 * rho, np.clip(self.gains.turn * heading, -most[1], most[1])), axis=-1)
        return np.where((rho > self.near)[..., None], go, turn)

    @property
    def _drive(self) -> DifferentialDrive:
        return self.robot.actuated_by(DifferentialDrive)

    @property
    def _braking(self) -> float:
        """Deceleration to plan with: what the slew rate allows, less a reserve [m/s²]."""
        slew = self._drive.response.slew
        return 0.8 * slew[0] if slew else self._drive.max_speed / 0.5
