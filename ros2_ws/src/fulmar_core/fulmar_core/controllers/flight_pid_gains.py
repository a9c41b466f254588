"""Gains of the cascaded PID of an aircraft by rule, from its linear model at cruise.

The innermost loops turn the craft like an oscillator of some frequency and damping, of which the air brings its part.
Of those and of the frequencies of the place that are tried, the gains are those of the fastest place with which every
mode of the whole craft, servos, motors and integrals included, is damped well.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import fields, replace

import numpy as np

from fulmar_core.controllers.flight_observer import ObserverNoise
from fulmar_core.controllers.flight_pid import SUMS, FlightPidGains, cascade
from fulmar_core.dynamics.flight_modes import continuous_model
from fulmar_core.dynamics.flight_schedule import MOTION, flight_model
from fulmar_core.dynamics.flight_trim import find_trim
from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces
from fulmar_core.robots.robot import Robot

SMALL = 1e-6  # departures that the cascade is linearised with
DAMPED = 0.3  # least damping of oscillations of the craft with its loops [-]
INNER = (0.6, 0.9, 1.4, 2.0, 3.0)  # damping of the innermost loops by themselves [-]
TRIED = np.geomspace(0.05, 1.0, 25).tolist()  # frequencies, as shares of what servos and commands follow
RATIOS = np.geomspace(1.0, 12.0, 12).tolist()  # of an inner frequency to that of the place
SLOW = 6.0  # of the frequency of a place to that of its integral
ALONG, ACROSS = (1, 3, 5, 7, 9), (0, 2, 4, 6, 8, 10)  # states of the motion of `flight_model`
Inner = tuple[float, float]  # natural frequency [rad/s] and damping [-]
STILL = 1e-3  # modes that are slower count as oscillating at this [rad/s]


@functools.lru_cache(maxsize=16)
def flight_pid_gains(robot: Robot) -> FlightPidGains:
    """Gains of an aircraft without a file.

    Raises:
        ConfigError: It has no trim at its speed.
    """
    loops = _Loops(robot)
    across = loops.best(loops.outline(), loops.across, ACROSS, ("aileron", "rudder"), (0,))
    return loops.best(across, loops.along, ALONG, ("elevator",), (1, 2))


class _Loops:
    """The loops of one craft, and the modes that it has with them."""

    def __init__(self, robot: Robot) -> None:
        craft, frame = robot.actuated_by(ControlSurfaces), robot.wings
        self._robot, self._craft, self._frame = robot, craft, frame
        trim = find_trim(robot, frame.speed, 0.5 * frame.span)
        self._rates, self._effects = continuous_model(robot, trim)
        self._dt = robot.timing.control_s
        self._model = flight_model(robot, trim, self._dt)
        self._quickest = min(craft.servo_rate, 0.1 / self._dt)

    def outline(self) -> FlightPidGains:
        """Limits, and the gains of the airspeed, which motors set."""
        lag = max((motor.lag_s for motor in self._craft.motors), default=0.0)
        speed, size = min(0.5, 0.25 / max(lag, 0.01)), self._frame.span / 5.0
        found = dict.fromkeys((field.name for field in fields(FlightPidGains)), 0.0) | {
            "path_lag_s": -1.0 / float(self._rates[8, 8]),
            "speed": speed,
            "speed_integral": 0.1 * speed * speed,
            "height_limit": 0.5 * size,
            "side_limit": 2.0 * size,
            "pitch_limit_deg": 3.0,
            "bank_limit_deg": 20.0,
            "smooth_s": 0.6,
        }
        noisy = self._robot.sensors.odometry.position.std > 0.0
        return FlightPidGains(**found | {"observer": ObserverNoise() if noisy else None})  # type: ignore[arg-type]

    def along(self, gains: FlightPidGains, inner: Inner, outer: float) -> FlightPidGains:
        """Gains of pitch and height, of the loop of the pitch, and a frequency of the height [rad/s]."""
        pitch, pitch_rate = self._inner("elevator", 10, inner)
        return replace(
            gains,
            pitch=pitch,
            pitch_rate=pitch_rate,
            climb=1.0,
            height=outer,
            height_integral=outer**2 / SLOW,
        )

    def across(self, gains: FlightPidGains, inner: Inner, outer: float) -> FlightPidGains:
        """Gains of bank and place to the side, of the loop of the bank, and a frequency of the place [rad/s]."""
        roll, roll_rate = self._inner("aileron", 9, inner)
        return replace(
            gains,
            roll=roll,
            roll_rate=roll_rate,
            yaw_rate=self._inner("rudder", 11, (0.5 * inner[0], inner[1]))[1],
            drift=2.0 * outer,
            side=outer,
            side_integral=outer**2 / SLOW,
        )

    def _inner(self, surface: str, axis: int, inner: Inner) -> tuple[float, float]:
        """Deflection per angle [-] and per rate [s] that turn about an axis like an oscillator of a frequency."""
        if surface not in self._craft.names:
            return 0.0, 0.0
        authority = float(self._effects[axis, self._craft.names.index(surface)])
        frequency, share = inner
        damping = 2.0 * share * frequency + float(self._rates[axis, axis])
        return frequency**2 / authority, max(0.0, damping) / authority

    def best(
        self,
        gains: FlightPidGains,
        laid_out: Callable[[FlightPidGains, Inner, float], FlightPidGains],
        motion: Sequence[int],
        surfaces: Sequence[str],
        sums: Sequence[int],
    ) -> FlightPidGains:
        """Gains of the fastest place with which every mode is damped well; where there are none, those damped best.

        Args:
            gains: Gains of the rest.
            laid_out: Gains of an inner loop and a frequency of the place.
            motion: States that the loops are about.
            surfaces: That they deflect.
            sums: Their integrals.
        """
        tried = [
            (share * self._quickest / ratio, (share * self._quickest, damping))
            for share, ratio, damping in itertools.product(TRIED, RATIOS, INNER)
        ]
        found, worst = gains, -math.inf
        for outer, inner in sorted(tried, reverse=True):
            one = laid_out(gains, inner, outer)
            damping = self._damping(one, motion, surfaces, sums)
            if damping > worst:
                found, worst = one, damping
            if damping >= DAMPED:
                break
        return found

    def _damping(
        self, gains: FlightPidGains, motion: Sequence[int], surfaces: Sequence[str], sums: Sequence[int]
    ) -> float:
        """Damping of the mode that is damped least, from -1 to 1 [-]."""
        own = [self._craft.names.index(name) for name in surfaces if name in self._craft.names]
        count = self._craft.positions
        servos = [MOTION + i for i in own] + [MOTION + count + i for i in own]
        motors = [MOTION + 2 * count + i for i in range(len(self._craft.motors))] if motion is ALONG else []
        kept = [*motion, *servos, *motors, *(len(self._model.a) + i for i in sums)]
        modes = np.log(np.linalg.eigvals(self._closed(gains)[np.ix_(kept, kept)]).astype(complex)) / self._dt
        return float(np.min(-modes.real / np.maximum(np.abs(modes), STILL)))

    def _closed(self, gains: FlightPidGains) -> np.ndarray:
        """The craft with its loops over a control step; the integrals are the last states."""
        model, count = self._model, len(self._model.a)
        whole = np.eye(count + SUMS.stop - SUMS.start)
        off = np.concatenate((whole[:, :MOTION], whole[:, count:]), axis=1)
        added = {
            name: value / SMALL for name, value in cascade(gains, SMALL * off, self._frame.speed).items()
        }
        slope = float(self._effects[6, self._craft.positions :].sum())  # acceleration ahead per throttle
        commands = [added[surface.name] for surface in self._craft.surfaces]
        commands += [added["acceleration"] / slope] * len(self._craft.motors)
        whole[:count, :count] = model.a
        whole[:count] += model.b @ np.stack(commands)
        for i, error in enumerate((0, 1, 5)):
            whole[count + i, error] = self._dt
        return whole
