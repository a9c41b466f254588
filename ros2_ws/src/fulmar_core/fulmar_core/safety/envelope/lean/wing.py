"""Coarse model of wings: departures from level flight by the craft's own linear models, its backup in the loop.

Each sample has a model of its own: forces are per its mass, torques per its inertia, and what actuators do counts by
its gain. Beyond the linear model, a bank tilts the lift, which then carries less than the weight.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from fulmar_core.dynamics.flight_schedule import MOTION, PLACE, RATE, SPEED, TURNED, FlightModel
from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.envelope.lean.samples import Samples
from fulmar_core.safety.envelope.lean.wing_backup import LevelFlightBackup
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.spatial import SpatialState

STEP_S = 0.04  # of the model, at least [s]
AHEAD_S = 1.6  # in which level flight is regained [s]
# Beyond these the linear model does not hold: bank, departure of the angle of attack, and sideslip [deg].
BANK_DEG, ATTACK_DEG, SLIP_DEG = 25.0, 8.0, 6.0
SLOWER = 0.2  # share of the cruising speed that it may lose or gain, for the same reason [-]
HEIGHT = PLACE.start + 1
ROLL, PITCH, YAW = (TURNED.start + i for i in range(3))
AHEAD, DRIFT, CLIMB = (SPEED.start + i for i in range(3))


@dataclass(frozen=True)
class WingLimits:
    """Largest departures over a rollout, all samples counted, each of shape (n,)."""

    lowest: np.ndarray  # of hull and wing tips above z = 0 [m]
    highest: np.ndarray  # of the centre of mass [m]
    bank: np.ndarray  # [rad]
    attack: np.ndarray  # departure of the angle of attack from level flight [rad]
    slip: np.ndarray  # angle of sideslip [rad]
    speed: np.ndarray  # departure of the speed [m/s]


class WingRollout:
    """Flies craft of one kind forward."""

    def __init__(self, robot: Robot, samples: Samples, dt: float, backup: LevelFlightBackup) -> None:
        """Make the samples' models.

        Args:
            robot: An aircraft.
            samples: Bodies and surroundings.
            dt: Time of a control step [s].
            backup: Whose law levels the craft.
        """
        self._backup, self._law, self._samples = backup, backup.law, samples
        craft = robot.actuated_by(ControlSurfaces)
        self._heights, self._models = self._law.schedule.heights, self._law.schedule.models
        self._each = max(1, round(STEP_S / dt))
        self._steps = round(AHEAD_S / (self._each * dt))
        self._dt, self._speed, self._limit = dt, robot.wings.speed, self._law.gains.error_limit
        surfaces, motors = craft.positions, len(craft.motors)
        self._levels = slice(MOTION + 2 * surfaces, MOTION + 2 * surfaces + motors)
        self._places = slice(MOTION, MOTION + surfaces)
        self._low, self._high = craft.lowest, craft.scale
        self._hull, self._half_span = robot.hull_span[0], 0.5 * robot.wings.span
        self._gains = self._law.schedule.array(self._heights)[:, :, : self._levels.stop]
        made = [self._model(model) for model in self._models]
        self._one = [self._whole(each, self._dt) for each in made]
        self._many = [self._whole(_repeated(*each, self._each), self._each * self._dt) for each in made]

    def _model(self, model: FlightModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """One control step of each sample: transposed matrices (k, x, x) and (k, m, x), and what is added (k, 1, x)."""
        its, count = self._samples, len(model.a)
        kinds = len(its.mass)
        size = np.ones((kinds, count))
        size[:, SPEED], size[:, RATE] = 1.0 / its.mass[:, None], 1.0 / its.inertia[:, None]
        change, effect = model.a - np.eye(count), model.b
        each = np.repeat(change[None], kinds, axis=0)
        motion = slice(0, MOTION)
        for columns in (self._places, self._levels):
            each[:, motion, columns] *= its.gain[:, None, None]
        each = size[:, :, None] * each
        into = size[:, :, None] * np.repeat(effect[None], kinds, axis=0)
        into[:, motion] *= its.gain[:, None, None]
        level = model.trim.command
        throttles = level[self._places.stop - MOTION :]
        lost = (its.gain - 1.0)[:, None] * (change[motion, self._levels] @ throttles)
        added = np.zeros((kinds, count))
        added[:, motion] = size[:, motion] * lost
        added[:, CLIMB] += self._dt * GRAVITY * (1.0 / its.mass - 1.0)
        return (np.eye(count) + each).swapaxes(1, 2), into.swapaxes(1, 2), added[:, None, :]

    def limits(self, state: SpatialState, servos: np.ndarray, command: np.ndarray) -> WingLimits:
        """How far n craft depart from level flight that carry out one step of a command and then level off.

        Args:
            state: Now, shapes (n,).
            servos: Where servos and motors are, as in `FlightServos.now`.
            command: Of the step, after every limit, shape (n, m).
        """
        heading = np.arctan2(state.vy, state.vx)
        own = self._backup.along(state, heading)
        aim = self._backup.aim(own.y, self._backup.held(own))
        level = self._law.level(self._law.schedule, aim)
        x = self._law.departures(own, aim, servos, level)
        nearest = np.abs(aim.place[:, 1, None] - self._heights).argmin(axis=1)
        found = np.empty((6, len(x)))
        for which in np.unique(nearest):
            here = nearest == which
            found[:, here] = self._flown(which, x[here], level[here], command[here], aim.place[here, 1])
        return WingLimits(*found)

    @staticmethod
    def _whole(parts: tuple[np.ndarray, np.ndarray, np.ndarray], dt: float) -> tuple[np.ndarray, float]:
        """What multiplies state, command and one, shape (k, x + m + 1, x), and what a level wing's lift adds [m/s]."""
        whole, lift = np.concatenate(parts, axis=1), dt * GRAVITY
        whole[:, -1, CLIMB] -= lift
        return whole, lift

    def _flown(
        self, which: int, x: np.ndarray, level: np.ndarray, command: np.ndarray, height: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """See `limits`, of craft that share a model."""
        kinds, (count, size), answers = len(self._samples.mass), x.shape, level.shape[1]
        # Of each step its state, its command as a departure from level flight, and a one.
        steps = np.ones((self._steps + 2, kinds, count, size + answers + 1))
        steps[0, ..., :size], steps[0, ..., size:-1] = x, command - level
        self._step(steps[0], steps[1], *self._one[which])
        low, high = self._low - level, self._high - level
        gain = np.ascontiguousarray(-self._gains[which].T)
        seen, wanted = np.empty((kinds, count, size)), np.empty((kinds, count, answers))
        place, each = seen[..., PLACE], self._many[which]
        for now, after in itertools.pairwise(steps[1:]):
            np.copyto(seen, now[..., :size])
            np.maximum(place, -self._limit, out=place)
            np.minimum(place, self._limit, out=place)
            np.matmul(seen.reshape(-1, size), gain, out=wanted.reshape(-1, answers))
            np.maximum(wanted, low, out=wanted)
            np.minimum(wanted, high, out=now[..., size:-1])
            self._step(now, after, *each)
        track = steps[1:, ..., :size]
        bank = np.abs(track[..., ROLL])
        over = height + track[..., HEIGHT]
        lowest = np.minimum(over + self._hull, over - self._half_span * np.sin(np.minimum(bank, 1.5)))
        attack = np.abs(track[..., PITCH] + track[..., CLIMB] / self._speed)
        speed = np.abs(track[..., AHEAD])
        slip = np.abs(track[..., YAW] - track[..., DRIFT] / self._speed)
        most = (part.max(axis=(0, 1)) for part in (over, bank, attack, slip, speed))
        return (lowest.min(axis=(0, 1)), *most)

    @staticmethod
    def _step(now: np.ndarray, after: np.ndarray, whole: np.ndarray, lift: float) -> None:
        """Write the state after a step; a bank tilts the lift."""
        state = after[..., : whole.shape[2]]
        np.matmul(now, whole, out=state)
        upright = np.cos(now[..., ROLL])
        np.maximum(upright, 0.0, out=upright)
        upright *= lift
        state[..., CLIMB] += upright


def _repeated(
    a: np.ndarray, b: np.ndarray, added: np.ndarray, times: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Several steps under one command as one."""
    one, into, plus = a, b, added
    for _ in range(times - 1):
        a, b, added = a @ one, b @ one + into, added @ one + plus
    return a, b, added
