"""Cascaded PID of aircraft: one loop within another, each a few times slower than the one inside it.

Height to climb rate to pitch to elevator; place to the side to drift to bank to aileron; a yaw damper on the rudder;
airspeed to throttle (Beard and McLain, Small Unmanned Aircraft, 2012, chapter 6, has such loops and their order). What
the reference asks for ahead goes in as in the LQI. Gains without a file follow from the craft's own linear model.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.flight_following import FlightFollowing
from fulmar_core.controllers.flight_observer import ObserverNoise
from fulmar_core.dynamics.flight_schedule import Schedule
from fulmar_core.states.gravity import GRAVITY

PLACE, TURNED, SPEED, RATE, SUMS = (slice(0, 2), slice(2, 5), slice(5, 8), slice(8, 11), slice(11, 14))
DEPARTURES = 14  # of `cascade`


@dataclass(frozen=True)
class FlightPidGains:
    """Gains, as read from `configs/controllers/<robot>_pid.yaml`."""

    height: float  # climb rate per height error [1/s]
    height_integral: float  # same per integral of it [1/s²]
    climb: float  # change of the path per error of it [-]
    path_lag_s: float  # by which the path follows the pitch, and the pitch therefore leads a bend upwards [s]
    pitch: float  # elevator per pitch error [-]
    pitch_rate: float  # elevator per pitch rate [s]
    side: float  # drift per error to the side [1/s]
    side_integral: float  # same per integral of it [1/s²]
    drift: float  # acceleration to the side per error of the drift [1/s]
    roll: float  # aileron per bank error [-]
    roll_rate: float  # aileron per roll rate [s]
    yaw_rate: float  # rudder per yaw rate that the bank does not ask for [s]
    speed: float  # acceleration per error of the airspeed [1/s]
    speed_integral: float  # same per integral of it [1/s²]
    height_limit: float  # height errors beyond count as this: more would ask for a climb that stalls [m]
    side_limit: float  # same to the side [m]
    pitch_limit_deg: float  # largest departure of the pitch that is asked for [deg]
    bank_limit_deg: float  # same of the bank [deg]
    smooth_s: float  # half of the time that the reference is smoothed over [s]
    observer: ObserverNoise | None = None  # as in `FlightWeights`

    def __post_init__(self) -> None:
        limits = self.height_limit, self.side_limit, self.pitch_limit_deg, self.bank_limit_deg, self.smooth_s
        if min(limits) <= 0.0:
            raise ValueError(
                "height_limit, side_limit, pitch_limit_deg, bank_limit_deg and smooth_s must be greater than 0."
            )


def cascade(gains: FlightPidGains, off: np.ndarray, speed: float) -> dict[str, np.ndarray]:
    """What the loops add to the commands of level flight, each of shape (n,).

    Args:
        gains: Gains and limits.
        off: Departures, shape (n, DEPARTURES): place to the left and up [m], rotation [rad], velocity [m/s], turn rate
            [rad/s], and the integrals of the errors of the place to the left and up [m·s] and of the speed [m].
        speed: Of cruise [m/s].

    Returns:
        Deflections by name [rad], `acceleration` that the motors shall make [m/s²], and `cut`, shape (n, 3): whether
        limits cut the bank, the pitch and the acceleration that the outer loops ask for.
    """
    g = gains
    (left, up), (roll, pitch, _), (ahead, drift, climb) = off[:, PLACE].T, off[:, TURNED].T, off[:, SPEED].T
    roll_rate, pitch_rate, yaw_rate = off[:, RATE].T
    left_sum, up_sum, ahead_sum = off[:, SUMS].T
    wanted_climb = -g.height * np.clip(up, -g.height_limit, g.height_limit) - g.height_integral * up_sum
    # A positive pitch is nose down.
    pitch_asked = -(wanted_climb + g.climb * (wanted_climb - climb)) / speed
    wanted_pitch = _within(pitch_asked, g.pitch_limit_deg)
    wanted_drift = -g.side * np.clip(left, -g.side_limit, g.side_limit) - g.side_integral * left_sum
    bend = g.drift * (wanted_drift - drift)
    # A positive bank is to the right.
    bank_asked = -bend / GRAVITY
    wanted_bank = _within(bank_asked, g.bank_limit_deg)
    return {
        "elevator": g.pitch * (wanted_pitch - pitch) - g.pitch_rate * pitch_rate,
        "aileron": g.roll * (wanted_bank - roll) - g.roll_rate * roll_rate,
        "rudder": -g.yaw_rate * (yaw_rate + GRAVITY / speed * wanted_bank),
        "acceleration": -g.speed * ahead - g.speed_integral * ahead_sum,
        "cut": np.stack(
            (wanted_bank != bank_asked, wanted_pitch != pitch_asked, np.zeros(len(ahead), dtype=bool)),
            axis=-1,
        ),
    }


def _within(angle: np.ndarray, most_deg: float) -> np.ndarray:
    most = math.radians(most_deg)
    return np.asarray(np.clip(angle, -most, most))


class FlightPid(FlightFollowing):
    """Cascaded PID of an aircraft."""

    law = "pid"
    title = "cascaded PID of aircraft"

    gains: FlightPidGains

    def bind(self) -> None:
        """See `Law.bind`."""
        self.follow(smooth_s=self.gains.smooth_s, observer=self.gains.observer)

    def prepare(self) -> None:
        """Solve the trims at every height."""
        self._schedule = Schedule(self.robot, self._speed, self._dt, lambda model: model.trim.command)

    def reset(self) -> None:
        """Forget the past."""
        super().reset()
        self._sums: np.ndarray | None = None

    def command(self, inputs: Inputs) -> np.ndarray:
        """Choose commands; shapes as in `Controller.act`."""
        aim, state = self.see(inputs)
        if self._sums is None or len(self._sums) != len(aim.place):
            self._sums = np.zeros((len(aim.place), 3))
        place = np.stack((state.y, state.z), axis=-1) - aim.place
        motion = self.motion(self._schedule, state, aim)
        motion[:, 1] += self.gains.path_lag_s * aim.bend[:, 1] / self._speed
        added = cascade(self.gains, np.concatenate((place, motion, self._sums), axis=-1), self._speed)
        command = self.level(self._schedule, aim)
        for i, surface in enumerate(self._craft.surfaces):
            command[:, i] += added[surface.name]
        push = self.robot.body.mass * added["acceleration"] / self.thrust_slope
        command[:, self._craft.positions :] += push[:, None]
        self._add_up(np.concatenate((place, motion[:, 3:4]), axis=-1), command, added["cut"])
        return command

    def _add_up(self, errors: np.ndarray, command: np.ndarray, cut: np.ndarray) -> None:
        """Go on with the integrals, but not where an error, a demand (n, 3) or a command is cut: no wind-up."""
        most = np.array([self.gains.side_limit, self.gains.height_limit, np.inf])
        free = (np.abs(errors) < most) & ~(self.saturated(command) | cut)
        assert self._sums is not None  # as in `command`
        self._sums = self._sums + self._dt * np.where(free, errors, 0.0)
