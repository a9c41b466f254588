"""LQR and LQI that hold an aircraft's attitude, or its airspeed and level flight, in free air, whatever its heading.

The state is that of body axes: bank and pitch from the aim, velocity and turn rate along the body's axes, servos and
motors, and, with integral action, the integrals of what is held (Stevens, Lewis and Johnson, Aircraft Control and
Simulation, 2016, §3.5 and §5.4). Errors of attitude and speed count up to a limit: after an upset the craft turns back
no faster than its wing carries.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.flight_law import FlightLaw
from fulmar_core.controllers.flight_lqi import FlightWeights
from fulmar_core.controllers.flight_servos import FlightServos
from fulmar_core.controllers.lqr import regulator
from fulmar_core.dynamics.flight_schedule import PLACE, SPEED, TURNED, between, flight_model
from fulmar_core.dynamics.flight_trim import Trim, find_trim
from fulmar_core.states.attitude import Quaternion, euler_of, length, scaled, turn, turn_back
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.spatial import SpatialState, quat_of
from fulmar_core.tasks.flight_terms import angle_of_attack, tilt_error, up_in_body
from fulmar_core.tasks.hold_flight import HoldAirspeed, HoldAttitude

SPEEDS = 3  # where gains are solved, from the lowest airspeed of a task to its highest
ROLL, PITCH = 0, 1  # of the reduced state; its velocity and turn rate follow, three each
BODY_VELOCITY, BODY_RATE = slice(2, 5), slice(5, 8)


@dataclass(frozen=True)
class Held:
    """What n craft shall hold."""

    quat: Quaternion  # each (n,); the heading does not count
    speed: np.ndarray  # (n,) [m/s]
    climb: np.ndarray  # (n,) sine of the path's angle


class FlightHold(FlightLaw):
    """Holds attitude or airspeed; integral action where the weights of places and those of angles have any."""

    law = "lqi"
    title = "LQI of aircraft that holds attitude or airspeed"

    gains: FlightWeights

    def bind(self) -> None:
        """See `Law.bind`."""
        self.fly()
        if not isinstance(self.task, HoldAttitude | HoldAirspeed):
            raise ValueError(f"the law holds attitude or airspeed, and '{self.task.name}' is about neither.")
        self._holds_climb = isinstance(self.task, HoldAirspeed)
        low, high = self.task.speed if isinstance(self.task, HoldAirspeed) else (1.0, 1.0)
        self._speeds = self._speed * np.linspace(low, high, SPEEDS if high > low else 1)
        self.believe(self.gains.observer, any_heading=True)
        self._servos = FlightServos(self._craft, self._dt)

    def prepare(self) -> None:
        """Solve for the gains at every speed."""
        of_places = max(self.gains.height_integral, self.gains.side_integral)  # 0 for the LQR
        self._integrates = min(of_places, self.gains.hold.angle_integral) > 0.0
        trims = [find_trim(self.robot, float(speed), None) for speed in self._speeds]
        self._solved = np.stack([self._gain_at(trim) for trim in trims])
        self._trims = np.stack([trim.command for trim in trims])
        self._quats = np.stack([np.array([float(part) for part in trim.state.quat]) for trim in trims])

    def reset(self) -> None:
        """Forget the past."""
        super().reset()
        self._servos.reset()
        self._sums: np.ndarray | None = None

    def _gain_at(self, trim: Trim) -> np.ndarray:
        """Gain over the reduced state and the three integrals, shape (m, n + 3)."""
        g, hold, dt = self.gains, self.gains.hold, self._dt
        a, b, climb = _reduced(*self._model(trim), trim)
        count, surfaces, motors = len(a), self._craft.positions, len(self._craft.motors)
        rows = np.zeros((3, count))
        rows[0, ROLL] = 1.0
        rows[1] = climb if self._holds_climb else np.eye(count)[PITCH]
        rows[2, BODY_VELOCITY] = _along(trim)
        middle = (hold.climb, hold.climb_integral) if self._holds_climb else (hold.angle, hold.angle_integral)
        weights = np.array([hold.angle, middle[0], hold.speed])
        base = np.full(count, 1e-3)
        base[BODY_RATE] = g.rate
        q = np.diag(base) + rows.T @ np.diag(weights) @ rows
        r = np.diag([*[g.surface] * surfaces, *[g.throttle] * motors])
        if self._integrates:
            a = np.block([[a, np.zeros((count, 3))], [dt * rows, np.eye(3)]])
            b = np.vstack((b, np.zeros((3, surfaces + motors))))
            ends = np.diag([hold.angle_integral, middle[1], hold.speed_integral])
            q = np.block([[q, np.zeros((count, 3))], [np.zeros((3, count)), ends]])
        return regulator(a, b, dt * q, dt * r).gain

    def _model(self, trim: Trim) -> tuple[np.ndarray, np.ndarray]:
        model = flight_model(self.robot, trim, self._dt)
        return model.a, model.b

    def _between(self, values: np.ndarray, speed: np.ndarray) -> np.ndarray:
        """Values at the solved speeds, at other ones, shape (n, ...)."""
        return between(values, self._speeds, speed)

    def _aim(self, inputs: Inputs) -> Held:
        """What the goals ask for; speeds that the task does not have count as its nearest."""
        target = np.asarray(inputs.goal.current, dtype=float)
        if self._holds_climb:
            speed = np.clip(target[:, 0], self._speeds[0], self._speeds[-1])
            quats = self._between(self._quats, speed)
            quats /= np.linalg.norm(quats, axis=-1, keepdims=True)
            return Held(quat_of_rows(quats), speed, 0.0 * speed)
        quat = quat_of(target)
        level = euler_of(quat_of_rows(self._quats[:1]))[1]
        return Held(quat, np.full(len(target), self._speed), np.sin(level - euler_of(quat)[1]))

    def command(self, inputs: Inputs) -> np.ndarray:
        """Choose commands; shapes as in `Controller.act`."""
        aim, state, servos = self._aim(inputs), self.believed(inputs), self._servos.after(inputs.previous)
        if self._sums is None or len(self._sums) != len(servos):
            self._sums = np.zeros((len(servos), 3))
        motion, held, free = self._motion_from(state, aim)
        trim = self._trim_at(aim)
        x = np.concatenate((motion, self._servos.departures(servos, trim)), axis=-1)
        if self._integrates:
            x = np.concatenate((x, self._sums), axis=-1)
        wanted = np.asarray(trim - np.einsum("nij,nj->ni", self._between(self._solved, aim.speed), x))
        if self._integrates:
            free = free & ~self.saturated(wanted)
            self._sums = self._sums + self._dt * np.where(free, held, 0.0)
        return wanted

    def _trim_at(self, aim: Held) -> np.ndarray:
        """Commands of the trim, with the thrust that a climb takes, shape (n, m)."""
        command = np.array(self._between(self._trims, aim.speed))
        command[:, self._craft.positions :] += (
            self.robot.body.mass * GRAVITY * aim.climb / self.thrust_slope
        )[:, None]
        return command

    def _motion_from(self, state: SpatialState, aim: Held) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Departures of the motion (n, 8), what is held (n, 3), and whether each of that counts in full (n, 3)."""
        hold = self.gains.hold
        tilt, up = tilt_error(state.quat, aim.quat), up_in_body(aim.quat)
        roll, pitch = (tilt[i] - up[i] / up[2] * tilt[2] for i in (0, 1))
        most = math.radians(hold.angle_limit_deg)
        size = np.hypot(roll, pitch)
        short = np.minimum(1.0, most / np.maximum(size, 1e-9))
        roll, pitch = short * roll, self._within_margin(short * pitch, state, aim)
        speed = np.asarray(length(state.velocity))
        fast = np.clip(speed - aim.speed, -hold.speed_limit, hold.speed_limit)
        # Of the velocity its direction counts in full, which is the angles of attack and sideslip.
        wanted = turn_back(quat_of_rows(self._between(self._quats, aim.speed)), (aim.speed, 0.0, 0.0))
        share = (aim.speed + fast) / np.maximum(speed, 1.0)
        velocity = np.stack(state.velocity_in_body, axis=-1) * share[:, None] - np.stack(wanted, axis=-1)
        bank = euler_of(aim.quat)[0]
        turning = scaled(-GRAVITY * np.tan(bank) / aim.speed, up)
        rates = np.stack(state.rate, axis=-1) - np.stack(turning, axis=-1)
        motion = np.concatenate((np.stack((roll, pitch), axis=-1), velocity, rates), axis=-1)
        middle, small = pitch, size < most
        if self._holds_climb:
            middle = np.clip(state.vz, -hold.speed_limit, hold.speed_limit)
        held = np.stack((roll, middle, fast), axis=-1)
        climbs = np.abs(middle) < hold.speed_limit if self._holds_climb else small
        return motion, held, np.stack((small, climbs & small, np.abs(fast) < hold.speed_limit), axis=-1)

    def _within_margin(self, pitch: np.ndarray, state: SpatialState, aim: Held) -> np.ndarray:
        """Errors of the pitch as far as the angle of attack, some time ahead, leaves room for them, shape (n,) [rad].

        Beyond its margin the error changes its sign, and the nose goes back.
        """
        hold = self.gains.hold
        ahead, _, up = turn_back(quat_of_rows(self._between(self._quats, aim.speed)), (aim.speed, 0.0, 0.0))
        most, margin = math.radians(hold.angle_limit_deg), math.radians(hold.attack_margin_deg)
        attack = angle_of_attack(state) + np.arctan2(up, ahead) - hold.lead_s * state.wy
        return np.asarray(np.clip(pitch, -most * (1.0 + attack / margin), most * (1.0 - attack / margin)))


class FlightHoldLqr(FlightHold):
    """The same without integral action."""

    law = "lqr"
    title = "LQR of aircraft that holds attitude or airspeed"


def quat_of_rows(quats: np.ndarray) -> Quaternion:
    """Components of quaternions (n, 4)."""
    x, y, z, w = quats.T
    return x, y, z, w


def _along(trim: Trim) -> np.ndarray:
    """Unit vector of the flight in the body of a trim, shape (3,)."""
    found = np.array([float(part) for part in turn_back(trim.state.quat, trim.state.velocity)])
    return np.asarray(found / np.linalg.norm(found))


def _reduced(a: np.ndarray, b: np.ndarray, trim: Trim) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A model of `schedule.flight_model` without place and heading, and the climb rate as a row of its state.

    Velocities become those along the body's axes; a turn about the vertical then changes nothing but the attitude, so
    that its part about z follows from the others and leaves.
    """
    count, quat = len(a), trim.state.quat
    axes = np.stack([np.array(turn(quat, tuple(np.eye(3)[i])), dtype=float) for i in range(3)], axis=-1)
    flown = trim.speed * _along(trim)
    across = np.array(
        [[0.0, -flown[2], flown[1]], [flown[2], 0.0, -flown[0]], [-flown[1], flown[0], 0.0]]
    )  # u = Rᵀ v + flown × turned
    to_body = np.eye(count)
    to_body[SPEED, SPEED], to_body[SPEED, TURNED] = axes.T, across
    back = np.linalg.inv(to_body)
    up = np.array([float(part) for part in up_in_body(quat)])
    heading = TURNED.start + 2
    kept = [i for i in range(PLACE.stop, count) if i != heading]
    pick, put = np.eye(count)[kept], np.eye(count)[:, kept]
    pick[0, heading], pick[1, heading] = -up[0] / up[2], -up[1] / up[2]
    climb = back[SPEED.start + 2] @ put
    return pick @ to_body @ a @ back @ put, pick @ to_body @ b, climb
