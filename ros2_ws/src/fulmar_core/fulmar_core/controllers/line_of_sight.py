"""Line-of-sight guidance for boats with fixed propellers.

Fossen, "Handbook of Marine Craft Hydrodynamics and Motion Control", 2011: the boat is steered along the line
of sight to the next waypoint, less its sideslip (ch. 10), by a heading controller on heading and turn rate
(ch. 12), and driven by a speed controller, both with the water's forces fed forward (feedback linearisation,
ch. 13). Where it has arrived it stops, and turns on the spot if a heading is wanted.
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
    way_to_turn_least,
)
from fulmar_core.controllers.planar_law import PlanarLaw
from fulmar_core.controllers.propeller_allocation import PropellerAllocation
from fulmar_core.robots.actuators.propellers import Propellers


@dataclass(frozen=True)
class LineOfSightGains:
    """Gains, as read from `configs/controllers/<robot>_line_of_sight.yaml`."""

    cruise: float  # fastest speed ahead [m/s]
    astern: float  # same astern; 0: always turn to goals behind [m/s]
    approach: float  # speed for each metre that is left [1/s]
    braking: float  # deceleration to plan with [m/s²]
    surge: float  # acceleration for an error of the speed [1/s]
    heading: float  # turn rate for an error of the heading [1/s]
    turn_rate: float  # fastest wanted turn [rad/s]
    yaw: float  # angular acceleration for an error of the turn rate [1/s]
    slowing: float  # speed falls with this power of the cosine of the bearing [-]
    sideslip: float  # share of the sideslip angle that the heading makes up for [-]
    corner: float  # share of the cruising speed at a waypoint where the path turns by a quarter or more [-]
    near: float  # what counts as there [m]
    least_thrust: float  # less is not worth a propeller's way through its dead band [N]
    speed_around: float  # fastest among obstacles, as a share of the speed where nothing stands about [-]

    def __post_init__(self) -> None:
        positive = (
            self.cruise, self.approach, self.braking, self.surge, self.heading, self.turn_rate, self.yaw,
            self.slowing, self.near, self.least_thrust, self.speed_around,
        )  # fmt: skip
        if min(positive) <= 0.0 or min(self.astern, self.sideslip, self.corner) < 0.0:
            raise ValueError(
                "gains must be greater than 0; astern, sideslip and corner must not be negative."
            )


class LineOfSight(PlanarLaw):
    """Sails to positions, to poses, through waypoints, and at velocities."""

    law = "line_of_sight"
    title = "line of sight"
    gains: LineOfSightGains

    def prepare(self) -> None:
        """Prepare the allocation."""
        propellers = self.robot.actuated_by(Propellers)
        self._allocation = PropellerAllocation(propellers, least=self.gains.least_thrust)

    def command(self, inputs: Inputs) -> np.ndarray:
        """Propeller commands; shapes as in `Controller.act`."""
        u, v, r = self.frame.motion(inputs)
        if self.frame.tracks:
            speed, _, turn = self.frame.wanted_motion(inputs)
        else:
            speed, turn = self._guided(inputs, u, v)
        push, moment = self._effort(u, v, r, speed - u, turn - r)
        return self._allocation.best(push, moment, inputs.previous)

    def _guided(self, inputs: Inputs, u: np.ndarray, v: np.ndarray) -> Vector:
        """Wanted speed [m/s] and turn rate [rad/s]."""
        gains, share = self.gains, self.share_of_speed
        goal = self.frame.goal(inputs)
        room = self.room(inputs, end_that_goes_first(u))
        rho = np.hypot(*goal)
        if self.frame.heads and gains.astern > 0.0:
            way = way_to_turn_least(goal, self.frame.turn(inputs), u)
        else:
            way = way_to_face(goal, u, backwards=gains.astern > 0.0)
        alpha = bearing(goal, way)
        cruise = np.where(way < 0.0, gains.astern, gains.cruise) * share
        last = np.zeros_like(rho) if self.frame.heads else self.last_speed(goal, inputs, cruise=cruise)
        fastest = stopping_speed(
            np.minimum(rho, room), gain=gains.approach * share, deceleration=gains.braking, last=last
        )
        speed = way * np.minimum(fastest, cruise) * np.maximum(np.cos(alpha), 0.0) ** gains.slowing
        slip = np.where(way * u > 0.1, np.arctan2(way * v, np.maximum(way * u, 0.1)), 0.0)
        turn = gains.heading * (alpha - gains.sideslip * slip)
        there = (rho < self.near) & (last == 0.0)
        left = self.frame.turn(inputs) if self.frame.heads else np.zeros_like(rho)
        speed = np.where(there, gains.approach * goal[0], speed)
        turn = np.where(there, gains.heading * left, turn)
        return speed, np.clip(turn, -gains.turn_rate, gains.turn_rate)

    def _effort(
        self, u: np.ndarray, v: np.ndarray, r: np.ndarray, more_speed: np.ndarray, more_turn: np.ndarray
    ) -> Vector:
        """Push [N] and moment [N·m] that make up for missing speed and turn rate, and for the water."""
        body, water = self.robot.body, self.robot.hydrodynamics
        added_u, added_v, added_r = water.planar_added_mass if water else (0.0, 0.0, 0.0)
        drag_u, _, drag_r = water.planar_damping(u, v, r) if water else (0.0, 0.0, 0.0)
        # (m + m_u) u' = X + drag + (m + m_v) v r, and (I + I_r) r' = N + drag + (m_u - m_v) u v.
        push = (body.mass + added_u) * self.gains.surge * more_speed - drag_u - (body.mass + added_v) * v * r
        moment = (
            (body.inertia[2] + added_r) * self.gains.yaw * more_turn - drag_r - (added_u - added_v) * u * v
        )
        return push, moment
