"""LQR and LQI of an aircraft, solved from its own linear models and scheduled over height.

The state is the departure from the smoothed reference: place, attitude, velocity and turn rate, servos and motors, and,
with integral action, the integrals of the place. What the reference asks for ahead goes in as attitude: pitch for a
climb rate, heading for a drift, bank for a bend (thesis §5.5.2 has the LQR; the feed-forward is ours).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.flight_following import FlightFollowing
from fulmar_core.controllers.flight_observer import ObserverNoise
from fulmar_core.controllers.flight_reference import Aim
from fulmar_core.controllers.flight_servos import FlightServos
from fulmar_core.controllers.lqr import regulator
from fulmar_core.dynamics.flight_schedule import FlightModel, Schedule
from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import clip, side_by_side
from fulmar_core.states.spatial import SpatialState


@dataclass(frozen=True)
class HoldWeights:
    """Weights per second of what tasks hold that are about attitude or airspeed."""

    angle: float = 20.0  # of bank and pitch, per rad²
    angle_integral: float = 20.0  # per (rad·s)²
    speed: float = 0.5  # per (m/s)²
    speed_integral: float = 0.1  # per m²
    climb: float = 1.0  # per (m/s)²
    climb_integral: float = 0.5  # per m²
    angle_limit_deg: float = 10.0  # errors of the attitude beyond count as this [deg]
    speed_limit: float = 2.0  # same of speed and climb [m/s]
    attack_margin_deg: float = 8.0  # of the angle of attack from that of level flight [deg]
    lead_s: float = 0.2  # ahead of which it counts [s]

    def __post_init__(self) -> None:
        if min(self.angle, self.speed, self.climb, self.angle_limit_deg, self.speed_limit) <= 0.0:
            raise ValueError("angle, speed, climb and both limits must be greater than 0.")
        integrals = self.angle_integral, self.speed_integral, self.climb_integral
        if min(integrals) < 0.0 or (min(integrals) == 0.0 and max(integrals) > 0.0):
            raise ValueError("weights of integrals must all be greater than 0, or all be 0.")
        if self.attack_margin_deg <= 0.0 or self.lead_s < 0.0:
            raise ValueError("attack_margin_deg must be greater than 0, and lead_s not negative.")


@dataclass(frozen=True)
class FlightWeights:
    """Weights per second, as read from `configs/controllers/<robot>_lqi.yaml` or `_lqr.yaml`."""

    height: float  # per m²
    side: float  # per m²
    height_integral: float  # per (m·s)²; 0 with `side_integral` 0: no integral action
    side_integral: float  # per (m·s)²
    attitude: float  # per rad²
    speed: float  # per (m/s)²
    rate: float  # per (rad/s)²
    surface: float  # of commands, per rad²
    throttle: float  # of commands [-]
    smooth_s: float  # half of the time that the reference is smoothed over [s]
    error_limit: float  # errors of the place beyond count as this [m]
    observer: ObserverNoise | None = (
        None  # of a Kalman filter on the craft's own model; None: state as measured
    )
    hold: HoldWeights = HoldWeights()  # of tasks without a reference

    def __post_init__(self) -> None:
        if min(self.height, self.side, self.surface, self.throttle, self.error_limit, self.smooth_s) <= 0.0:
            raise ValueError(
                "height, side, surface, throttle, smooth_s and error_limit must be greater than 0."
            )
        if min(self.height_integral, self.side_integral, self.attitude, self.speed, self.rate) < 0.0:
            raise ValueError("weights must not be negative.")


class FlightLqi(FlightFollowing):
    """Linear-quadratic regulator of an aircraft, with integral action where the weights have any."""

    law = "lqi"
    title = "LQI of aircraft, scheduled over height"

    gains: FlightWeights

    def bind(self) -> None:
        """See `Law.bind`."""
        self.follow(smooth_s=self.gains.smooth_s, observer=self.gains.observer)
        self._servos = FlightServos(self._craft, self._dt)

    def prepare(self) -> None:
        """Solve for the gains at every height."""
        self._integrates = max(self.gains.height_integral, self.gains.side_integral) > 0.0
        self.schedule = Schedule(self.robot, self._speed, self._dt, self._gain)

    def _gain(self, model: FlightModel) -> np.ndarray:
        return regulator(*self._problem(model)).gain

    def _problem(self, model: FlightModel) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Model and costs of a step, arguments of `regulator`."""
        g, dt, count = self.gains, self._dt, len(model.a)
        surfaces, motors = self._craft.positions, len(self._craft.motors)
        weights = [g.side, g.height, *[g.attitude] * 3, *[g.speed] * 3, *[g.rate] * 3]
        q = np.diag([*weights, *[1e-3] * (2 * surfaces + motors)])
        r = np.diag([*[g.surface] * surfaces, *[g.throttle] * motors])
        a, b = model.a, model.b
        if self._integrates:
            a = np.block([[a, np.zeros((count, 2))], [dt * np.eye(2, count), np.eye(2)]])
            b = np.vstack((b, np.zeros((2, surfaces + motors))))
            q = np.diag([*np.diag(q), g.side_integral, g.height_integral])
        return a, b, dt * q, dt * r

    def reset(self) -> None:
        """Forget the past."""
        super().reset()
        self._servos.reset()
        self._sums: np.ndarray | None = None

    def command(self, inputs: Inputs) -> np.ndarray:
        """Choose commands; shapes as in `Controller.act`."""
        aim, state = self.see(inputs)
        return self.answer(state, aim, self.servos_after(inputs))

    def servos_after(self, inputs: Inputs) -> np.ndarray:
        """Deflections and thrust levels, then rates of the servos, by the commands that were sent, shape (n, k)."""
        count = len(inputs.previous)
        if self._sums is None or len(self._sums) != count:
            self._sums = np.zeros((count, 2))
        return self._servos.after(inputs.previous)

    def answer(self, state: SpatialState, aim: Aim, servos: np.ndarray) -> np.ndarray:
        """Commands for n craft, before the actuators' limits, shape (n, m).

        Args:
            state: Believed, shapes (n,).
            aim: Of n craft.
            servos: As in `servos_after`.
        """
        level = self.level(self.schedule, aim)
        x = self._departures(state, aim, servos, level)
        if self._integrates:
            assert self._sums is not None  # as in `servos_after`
            off = x[:, :2]
            x = np.concatenate((x, self._sums), axis=-1)
            free = np.abs(off) < self.gains.error_limit
            self._sums = self._sums + self._dt * np.where(free, off, 0.0)
        gain = self.schedule.array(aim.place[:, 1])
        return np.asarray(level - np.einsum("nij,nj->ni", gain, self._with_constants(x)))

    def _with_constants(self, x: np.ndarray) -> np.ndarray:
        """Departures and integrals, shape (n, k), with what else the gains are for; here nothing."""
        return x

    def answers(
        self, states: SpatialState, aim: Aim, servos: np.ndarray, *, share: float = 1.0
    ) -> np.ndarray:
        """Same as `answer`, of k states of each of n craft, without integral action, shape (n k, m).

        Args:
            states: Shapes (n k,), those of one craft side by side.
            aim: Of n craft.
            servos: Of every state, shape (n k, ...).
            share: Of the answer to departures; 0: commands of level flight alone [-].
        """
        count = len(aim.place)
        each = len(states.x) // count
        own = Aim(*(np.repeat(part, each, axis=0) for part in (aim.place, aim.rate, aim.bend)))
        level = np.repeat(self.level(self.schedule, aim), each, axis=0)
        x = self._departures(states, own, servos, level)
        gain = self.schedule.array(aim.place[:, 1])[..., : x.shape[-1]]
        back = x.reshape(count, each, -1) @ gain.transpose(0, 2, 1)
        return np.asarray(level - share * back.reshape(count * each, -1))

    def _departures(self, state: SpatialState, aim: Aim, servos: np.ndarray, level: np.ndarray) -> np.ndarray:
        """Departures from level flight along an aim, those of the place cut, shape (n, k)."""
        limit = self.gains.error_limit
        off = clip(side_by_side(state.y, state.z) - aim.place, -limit, limit)
        parts = off, self.motion(self.schedule, state, aim), self._servos.departures(servos, level)
        return np.concatenate(parts, axis=-1)


class FlightLqr(FlightLqi):
    """The same without integral action."""

    law = "lqr"
    title = "LQR of aircraft, scheduled over height"


def flight_lqi_weights(robot: Robot) -> FlightWeights:
    """Weights of an aircraft without a file: those of airship_v7, of the place in proportion to the span."""
    size = robot.wings.span / 5.0
    noise = ObserverNoise() if robot.sensors.odometry.position.std > 0.0 else None
    return FlightWeights(
        height=200.0 / size**2,
        side=40.0 / size**2,
        height_integral=40.0 / size**2,
        side_integral=10.0 / size**2,
        attitude=1.0,
        speed=0.25,
        rate=1.0,
        surface=20.0,
        throttle=2.0,
        smooth_s=0.6,
        error_limit=0.1
        * size,  # more makes craft in turbulence leave the angles that the coefficients hold for
        observer=noise,
    )


def flight_lqr_weights(robot: Robot) -> FlightWeights:
    """The same without integral action."""
    return replace(flight_lqi_weights(robot), height_integral=0.0, side_integral=0.0)
