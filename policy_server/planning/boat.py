"""A boat's motion in the plane as formulas that an optimiser can differentiate.

The dynamics of `fulmar_core.dynamics.free_body` in the body's frame (Fossen 2011, eq. 6.109 on the diagonal), for
still water and the nominal body; corners of the thrust curve and of quadratic drag are rounded, so that slopes are
continuous.
A state is (x, y [m], yaw [rad], ahead, to the left [m/s], turn rate [rad/s], then each propeller's command [-]).
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from fulmar_core.actuators.propellers import Propellers
from fulmar_core.robot import Robot

MOTION = 6  # numbers of a state before the commands
_CORNER = 0.02  # half width of a rounded corner of the thrust curve, in commands [-]
_CREEP = 1e-3  # speed below which drag is rounded [m/s, rad/s]
_SUBSTEP_S = 0.05  # longest step of `Boat.step` [s]


class Boat:
    """The formulas of one robot.

    Attributes:
        size: Numbers of a state.
        least: Lowest command that changes the thrust; what is below it only has to be slewed back [-].
        most: Highest one [-].
        slew: Fastest change of each command, shape (n,) [1/s].
        pace: CasADi function from a state to the rates of its first six numbers.
    """

    def __init__(self, robot: Robot) -> None:
        """Write the formulas of a robot with propellers that slew, as `check_planner` takes it."""
        actuators, water = robot.actuators, robot.hydrodynamics
        assert isinstance(actuators, Propellers) and water is not None
        self.slew = np.asarray(actuators.response.slew)
        self.size = MOTION + len(self.slew)
        self._curve = np.asarray(actuators.curve)
        self._commands = np.linspace(-1.0, 1.0, len(self._curve))
        self.least = float(self._commands[np.flatnonzero(self._curve == self._curve[0])[-1]])
        self.most = float(self._commands[np.flatnonzero(self._curve == self._curve[-1])[0]])
        surge, sway, turn = water.planar_added_mass
        along, across = robot.body.mass + surge, robot.body.mass + sway
        (du, dv, *_, dr), (qu, qv, *_, qr) = water.linear_damping, water.quadratic_damping
        state = ca.SX.sym("state", self.size)
        _, _, yaw, u, v, r, *commands = ca.vertsplit(state)
        thrust = [self._thrust(command) for command in commands]
        moment = sum(float(arm) * each for arm, each in zip(actuators.lever_arms, thrust, strict=True))
        rates = ca.vertcat(
            ca.cos(yaw) * u - ca.sin(yaw) * v,
            ca.sin(yaw) * u + ca.cos(yaw) * v,
            r,
            (sum(thrust) - (du + qu * _size(u)) * u + across * v * r) / along,
            (-(dv + qv * _size(v)) * v - along * u * r) / across,
            (moment - (dr + qr * _size(r)) * r + (surge - sway) * u * v) / (robot.body.inertia[2] + turn),
        )
        self.pace = ca.Function("pace", [state], [rates])

    def useful(self, states: np.ndarray) -> np.ndarray:
        """States with commands as far as they change the thrust, shape (..., size); a copy."""
        commands = np.clip(states[..., MOTION:], self.least, self.most)
        return np.concatenate((states[..., :MOTION], commands), axis=-1)

    def step(self, dt: float) -> ca.Function:
        """CasADi function from a state and the commands' rates to the state after `dt` [s], by Runge and Kutta."""
        state, rates = ca.SX.sym("state", self.size), ca.SX.sym("rates", len(self.slew))
        count = int(np.ceil(dt / _SUBSTEP_S))
        h, s = dt / count, state

        def pace(at: Any) -> Any:
            return ca.vertcat(self.pace(at), rates)

        for _ in range(count):
            a = pace(s)
            b = pace(s + 0.5 * h * a)
            c = pace(s + 0.5 * h * b)
            s = s + h / 6.0 * (a + 2.0 * b + 2.0 * c + pace(s + h * c))
        return ca.Function("step", [state, rates], [s])

    def _thrust(self, command: Any) -> Any:
        """Thrust of one propeller by the curve with its corners rounded [N]."""
        slopes = np.diff(self._curve) / np.diff(self._commands)
        thrust, before = float(self._curve[0]), 0.0
        for place, slope in zip(self._commands[:-1], slopes, strict=True):
            if slope != before:
                thrust = thrust + (slope - before) * _ramp(command - place)
            before = slope
        return thrust


def _ramp(z: Any) -> Any:
    """The greater of z and 0, a parabola within `_CORNER` of 0."""
    above = ca.fmax(z + _CORNER, 0.0)
    return ca.if_else(z < _CORNER, above * above / (4.0 * _CORNER), z)


def _size(speed: Any) -> Any:
    """The speed's absolute value, smooth at 0."""
    return ca.sqrt(speed * speed + _CREEP * _CREEP)
