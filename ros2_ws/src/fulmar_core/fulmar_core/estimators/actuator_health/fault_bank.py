"""Bank of filters over faults of valves and fans: which of them explains the measured motion.

Interacting multiple models (Blom and Bar-Shalom 1988, "The interacting multiple model algorithm for systems with
Markovian switching coefficients"): each filter believes in one hypothesis, moves the body under the wrench that the
applied commands then have, and estimates a push from outside. A hypothesis that nothing speaks for goes on from what
the likely ones believe, so that it explains a fault from the moment on at which it begins.

The body's mass and inertia are known up to a factor each, estimated beside every filter (Friedland 1969, "Treatment of
bias in recursive filtering"). All axes are the world's, so that a filter is the same linear one for every axis: pose,
velocity and acceleration by the push. Turns are summed up as rotation vectors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.estimators.actuator_health.applied import Applied
from fulmar_core.estimators.actuator_health.axis_filter import AxisFilters, Gains
from fulmar_core.estimators.actuator_health.body_motion import (
    BodyMotion,
    crossed,
    matrix_about,
    rotation_vector,
)
from fulmar_core.estimators.actuator_health.hypotheses import Hypotheses, Kind
from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.robots.robot import Robot
from fulmar_core.states.state import RigidBodyState

WORST = 25.0  # mean square of one measurement's errors that counts at most [-]
MOVING, TURNING = 0, 1  # groups of axes, each with a filter and a factor of its own


@dataclass(frozen=True)
class BankSettings:
    """How far to trust model and measurements; forces as shares of one actuator's thrust, torques of its moment."""

    model: float = 0.04  # what the model leaves out, anew at each step [-]
    push: float = 0.3  # push from outside at the beginning [-]
    drift: float = 0.03  # its change in one second [-]
    sudden: float = 1.0  # its change in one second where something pushes as it likes, and its beginning [-]
    position: float = 0.001  # least error of a measured coordinate [m]
    heading: float = 0.002  # same [rad]
    velocity: float = 0.005  # same [m/s]
    yaw_rate: float = 0.01  # same [rad/s]
    learned_s: float = 2.0  # in which a push is learned, about [s]
    misfit: float = 0.1  # error of the wrench of a command, anew at each step, as a share of it [-]
    wander: float = 0.05  # change of the factors in one second [-]
    change: float = 2e-3  # chance that what is wrong changes, in one second [-]
    anew: float = 0.2  # share of its chance before anything is seen, below which one begins anew [-]
    surprise: float = 12.0  # largest weight of one measurement against a hypothesis, as log-likelihood [-]
    first_misfit: float = 2.0  # mean square of the errors of the best hypothesis, before any is seen [-]
    memory_s: float = 4.0  # over which the errors of the best hypothesis are averaged [s]


class FaultBank:
    """The bank, for one robot.

    Attributes:
        hypotheses: What it decides between.
        chance: Of each, shape (hypotheses,) [-].
    """

    def __init__(self, robot: Robot, settings: BankSettings | None = None) -> None:
        """List the hypotheses; the robot is one of `can_monitor`."""
        self._body, self._settings = robot.body, settings or BankSettings()
        self.hypotheses = Hypotheses(robot)
        # The planar simulators' semi-implicit Euler steps move a body a little farther than dt²/2.
        self._tick = robot.timing.physics_dt if robot.body.planar else 0.0
        self._axes = np.array([0, 1, 5] if robot.body.planar else range(6))
        self._moving = int((self._axes < 3).sum())  # how many, the first ones; the others turn
        self._numbers = 2.0 * np.array(
            [self._moving, len(self._axes) - self._moving]
        )  # measured, of each group
        self._com = np.array(robot.body.com)
        self._inertia = robot.body.inertia_matrix
        self._inverse = np.linalg.inv(self._inertia)
        spans, body = robot.uncertainty, robot.body
        #: Least and largest factor on accelerations and turn accelerations.
        self._factors = np.array(
            [
                [body.mass / spans.mass[1], body.mass / spans.mass[0]],
                [body.inertia[2] / spans.yaw_inertia[1], body.inertia[2] / spans.yaw_inertia[0]],
            ]
        ).T
        self._spread = np.clip(0.3 * (self._factors[1] - self._factors[0]), 0.05, 0.5)
        #: Largest force and moment of one actuator that can move the body [N, N·m].
        self.one_actuator = _one_actuator(robot)
        self._filters, one = _filters(robot, self._settings, self.one_actuator)
        #: 1 for hypotheses that go on with the push that is left beside them.
        self._for_long = np.array([float(each.for_long) for each in self.hypotheses.all])[:, None]
        easy = np.array([each.kind is Kind.PUSHED for each in self.hypotheses.all], dtype=int)
        group = np.array([MOVING] * self._moving + [TURNING] * (len(self._axes) - self._moving))
        #: Acceleration of each axis by one actuator.
        self._unit = one[group]
        self._which = 2 * easy[:, None] + group  # filter of each hypothesis and axis
        self._group = group  # of each axis
        self._gains: tuple[Gains, Gains, np.ndarray] | None = None  # see `_gains_of`
        self._few = self._settings.anew * self.hypotheses.prior
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        count, axes = len(self.hypotheses.all), len(self._axes)
        self._last: BodyMotion | None = None
        self.chance = self.hypotheses.prior.copy()
        # Pose, velocity and acceleration by the push, and the response of these to the factors.
        self._both = np.zeros((2, 3, count, axes))
        self._state, self._response = self._both
        self._factor = np.ones((count, 2))
        self._doubt = np.tile(self._spread**2, (count, 1))
        self._usual = np.zeros((count, axes))  # mean acceleration by the commands of late
        # Mean square of the best hypothesis' white errors of each group, at least 1.
        self._noise = np.full(2, self._settings.first_misfit)
        self._filters.reset()

    @property
    def misfit(self) -> float:
        """Mean square of the errors of the likeliest hypothesis, in standard deviations, at least 1."""
        return float(self._noise.max())

    def push(self, number: int) -> np.ndarray:
        """Force and torque from outside under a hypothesis, along the world's axes, shape (6,) [N, N·m]."""
        wrench = np.zeros(6)
        wrench[self._axes] = self._state[2, number]
        wrench[:3] *= self._body.mass
        rotation = self._last.rotation if self._last is not None else np.eye(3)
        wrench[3:] = rotation @ self._inertia @ rotation.T @ wrench[3:]
        return wrench

    def needs_less_push(self, number: int, other: int) -> bool:
        """Whether a hypothesis needs less push from outside than another one to explain the mean motion of late."""
        push = self._state[2, number] / self._unit
        between = (
            self._by_axis(self._factor)[number] * (self._usual[other] - self._usual[number]) / self._unit
        )
        rest = push - between
        return bool(push @ push <= rest @ rest)

    def take(self, state: RigidBodyState, applied: Applied | None) -> None:
        """Take a measurement.

        Args:
            state: Measured motion.
            applied: What the actuators did since the last measurement; None where that is not known: then nothing is
                learned from this one.
        """
        motion = BodyMotion(state, self._com)
        last, self._last = self._last, motion
        if last is None or applied is None:
            self._restart(motion)
        else:
            self._follow(last, motion, applied)

    def _restart(self, motion: BodyMotion) -> None:
        """Go on from a measurement with what is believed of push and faults."""
        self._begin = np.concatenate((motion.position, np.zeros(3)))
        self._turned = np.zeros(3)
        self._state[0], self._state[1] = 0.0, motion.velocity[self._axes]
        self._response[...] = 0.0
        self._filters.restart()

    def _follow(self, last: BodyMotion, motion: BodyMotion, applied: Applied) -> None:
        dt = applied.duration_s
        half = 0.5 * dt * (dt + self._tick)
        swing = rotation_vector(motion.rotation @ last.rotation.T)
        self._turned = self._turned + swing
        place, speed, free = self._accelerations(last, swing, applied)
        factor = self._by_axis(self._factor)
        both = _moved(self._both, dt, half)
        ahead, response = both
        ahead[0] += half * (factor * place + free)
        ahead[1] += dt * (factor * speed + free)
        response[0] += half * place
        response[1] += dt * speed
        self._usual += min(1.0, dt / self._settings.learned_s) * (speed - self._usual)
        # Errors of pose and velocity, and what leaves no response of either.
        off = np.negative(both[:, :2])
        off[0, 0] += (np.concatenate((motion.position, self._turned)) - self._begin)[self._axes]
        off[0, 1] += motion.velocity[self._axes]
        self._learn(both, off, dt, half)

    def _learn(self, both: np.ndarray, off: np.ndarray, dt: float, half: float) -> None:
        """Learn from the errors of pose and velocity; shapes (2, 3 or 2, hypotheses, axes)."""
        s = self._settings
        gains, log_white = self._gains_of(dt, half)
        white = _white(gains, off)
        odd, about = white
        squares = white * about
        along, common = self._by_group(squares[1]), self._by_group(squares[0])
        doubt = self._doubt + s.misfit**2
        spread = doubt * along
        wider = 1.0 + spread
        square = self._by_group(odd * odd) - common * common * doubt / wider
        surprise = square / self._noise + np.log1p(spread)
        surprise = 0.5 * (surprise[:, 0] + surprise[:, 1]) - log_white
        surprise -= surprise.min()
        chance = self.chance * np.exp(-np.minimum(surprise, s.surprise))
        self.chance = chance / chance.sum()
        share = min(1.0, dt / s.memory_s)
        fresh = np.minimum(square[self.chance.argmax()] / self._numbers, WORST)
        self._noise = np.maximum(1.0, self._noise + share * (fresh - self._noise))
        # Two stages: first the factors, then the motion under them.
        left = self._doubt / wider
        least, most = self._factors
        factor = np.minimum(np.maximum(self._factor - left * common, least), most)
        both += gains.pose * off[:, :1]
        both += gains.velocity * off[:, 1:]
        both[0] += self._by_axis(factor - self._factor) * both[1]
        self._mix(both, factor, left + s.wander**2 * dt, dt)

    def _mix(self, both: np.ndarray, factor: np.ndarray, doubt: np.ndarray, dt: float) -> None:
        """Let unlikely hypotheses go on from what the likely ones believe."""
        change, chance = self._settings.change * dt, self.chance
        own = (chance / (chance + self._few))[:, None]
        rest = 1.0 - own
        anew = np.empty_like(both)
        anew[...] = (chance @ both)[:, :, None]
        anew[0, 2] += self._for_long * (chance @ self._usual - self._usual)
        self._both = own * both
        self._both += np.multiply(rest, anew, out=anew)
        self._state, self._response = self._both
        self._factor = own * factor + rest * (chance @ factor)
        self._doubt = own * doubt + rest * (chance @ doubt)
        self.chance = (1.0 - change) * chance + change * self.hypotheses.prior

    def _gains_of(self, dt: float, half: float) -> tuple[Gains, np.ndarray]:
        """Of each hypothesis and axis, shapes (hypotheses, axes), and the sum of their `log_white`."""
        gains = self._filters.advance(dt, half)
        if self._gains is None or self._gains[0] is not gains:
            each = gains.at(self._which)
            self._gains = gains, each, each.log_white.sum(axis=-1)
        return self._gains[1:]

    def _by_axis(self, values: np.ndarray) -> np.ndarray:
        """Numbers of both groups, shape (hypotheses, 2), for every axis."""
        return np.asarray(values.take(self._group, axis=1))

    def _by_group(self, values: np.ndarray) -> np.ndarray:
        """Sums of two squares over the axes of both groups, shape (2, hypotheses, axes) to (hypotheses, 2)."""
        each = values[0] + values[1]
        found = np.empty((len(each), 2))
        for group, begin, end in ((MOVING, 0, self._moving), (TURNING, self._moving, each.shape[1])):
            total = each[:, begin]
            for axis in range(begin + 1, end):
                total = total + each[:, axis]
            found[:, group] = total
        return found

    def _accelerations(
        self, last: BodyMotion, swing: np.ndarray, applied: Applied
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Accelerations along and about the world's axes within an interval.

        Returns:
            By the commands, as they move the body, shape (hypotheses, axes); as they change its velocity, same; by the
            body's own turning, shape (axes,).
        """
        seconds = applied.seconds
        whole = float(seconds.sum())
        middle = matrix_about(0.5 * swing) @ last.rotation
        to_world = np.zeros((6, 6))
        to_world[:3, :3] = middle.T / self._body.mass
        to_world[3:, 3:] = self._inverse @ middle.T
        to_world = to_world[:, self._axes]
        wrenches = self.hypotheses.wrenches(applied.commands)
        if len(seconds) == 1:
            place = speed = wrenches[0] @ to_world
        else:
            # An early push moves the body farther than a late one: it has the rest of the interval to do so.
            rest = whole - np.cumsum(seconds)
            early = seconds * (2.0 * rest + seconds + self._tick) / (whole * (whole + self._tick))
            place = np.tensordot(early, wrenches, 1) @ to_world
            speed = np.tensordot(seconds / whole, wrenches, 1) @ to_world
        rate = middle.T @ swing / whole  # about the body's axes
        free = np.zeros(6)
        free[3:] = -middle @ self._inverse @ crossed(rate, self._inertia @ rate)
        return place, speed, free[self._axes]


def _moved(state: np.ndarray, dt: float, half: float) -> np.ndarray:
    """Pose, velocity and push after a step without commands, shape (2, 3, ...)."""
    moved = state.copy()
    moved[:, 0] += dt * state[:, 1] + half * state[:, 2]
    moved[:, 1] += dt * state[:, 2]
    return moved


def _white(gains: Gains, off: np.ndarray) -> np.ndarray:
    """White numbers of innovations of pose and velocity, shapes (2, 2, ...)."""
    white: np.ndarray = gains.white[:2] * off[:, :1]
    white[:, 1] += gains.white[2] * off[:, 1]
    return white


def _one_actuator(robot: Robot) -> tuple[float, float]:
    """Largest force and moment of one actuator along axes in which the body moves [N, N·m]."""
    actuators = robot.actuated_by(Pushing)
    wrench = actuators.full_thrust[:, None] * actuators.wrench_per_newton
    axes = [[0, 1], [5]] if robot.body.planar else [[0, 1, 2], [3, 4, 5]]
    force, moment = (float(np.linalg.norm(wrench[:, part], axis=1).max()) for part in axes)
    return force, moment


def _filters(
    robot: Robot, s: BankSettings, one_actuator: tuple[float, float]
) -> tuple[AxisFilters, np.ndarray]:
    """Filters of both groups for most hypotheses, and of both for a push that changes as it likes.

    Returns:
        The filters, and the acceleration of both groups by one actuator, shape (2,).
    """
    odometry = robot.sensors.odometry
    pose = [max(s.position, odometry.position.std), max(s.heading, odometry.heading.std)]
    velocity = [max(s.velocity, odometry.velocity.std), max(s.yaw_rate, odometry.yaw_rate.std)]
    inertia = robot.body.inertia[2] if robot.body.planar else min(robot.body.inertia[:3])
    one = np.array(one_actuator) / (robot.body.mass, inertia)
    twice = np.concatenate((one, one))
    shares = np.repeat([[s.push, s.drift], [s.sudden, s.sudden]], 2, axis=0)
    filters = AxisFilters(
        np.array(pose * 2),
        np.array(velocity * 2),
        s.model * twice,
        shares[:, 0] * twice,
        shares[:, 1] * twice,
    )
    return filters, one
