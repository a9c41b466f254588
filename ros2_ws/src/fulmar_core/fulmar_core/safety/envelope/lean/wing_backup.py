"""Backup of wings: they cannot stop, so the robot's own law holds a height, in level flight or in a level turn."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.flight_lqi import FlightLqi, FlightWeights
from fulmar_core.controllers.flight_reference import Aim
from fulmar_core.controllers.flight_refuge import descent_weights
from fulmar_core.estimators.actuator_health.actuator_estimator import ActuatorEstimate
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.envelope.lean.circles import BANK_DEG
from fulmar_core.states.attitude import from_euler, product
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import load_task

LOWEST_M = 0.5  # of the hull above the ground, where the height is held at least [m]


def recovery_weights(robot: Robot) -> FlightWeights:
    """Weights of the backup: those of the level descent, but gentle with surfaces and places, and damped.

    A law that asks for full surfaces at a few degrees swings an upset craft between their limits, ever wider.
    """
    size = robot.wings.span / 5.0
    return replace(
        descent_weights(robot),
        height=50.0 / size**2,
        height_integral=5.0 / size**2,
        rate=60.0,
        surface=600.0,
        throttle=200.0,
        error_limit=0.2 * size,
    )


class LevelLaw(FlightLqi):
    """The law of the level descent with other weights, of n craft that begin at times of their own."""

    def begin(self, which: np.ndarray) -> None:
        """Forget the integrals of some craft, shape (n,)."""
        if self._sums is not None and len(self._sums) == len(which):
            self._sums = np.where(which[:, None], 0.0, self._sums)

    def departures(self, state: SpatialState, aim: Aim, servos: np.ndarray, level: np.ndarray) -> np.ndarray:
        """As `_departures`, those of the place in full, shape (n, k)."""
        off = np.stack((state.y, state.z), axis=-1) - aim.place
        parts = off, self.motion(self.schedule, state, aim), self._servos.departures(servos, level)
        return np.concatenate(parts, axis=-1)


class LevelFlightBackup:
    """Levels the wings of n craft, or turns them, and holds each at its height or, if that is too low, above.

    Attributes:
        law: The robot's law for a height.
        turns: Which way each craft turns if it is held: +1 to the left, -1 to the right, 0 not at all, shape (n,).
        servos: Where servos and motors are, by what was sent; see `FlightServos.now`.
    """

    def __init__(self, robot: Robot, control_hz: float, ground: float = 0.0) -> None:
        """Solve for the gains.

        Args:
            robot: An aircraft.
            control_hz: Command rate [Hz].
            ground: Height of the lowest bound [m].

        Raises:
            ConfigError: The craft has no trim at its speed.
        """
        task = load_task("fly_hold").fitted(robot)
        self.law = LevelLaw(robot, task, recovery_weights(robot), control_hz=control_hz)
        self._floor = LOWEST_M + ground - robot.hull_span[0]
        bank = math.radians(BANK_DEG)
        self._higher = 0.5 * robot.wings.span * math.sin(bank)  # in turns, for the tip of the lower wing [m]
        self._bend = GRAVITY * math.tan(bank)
        self.reset()

    def reset(self) -> None:
        """Forget the past."""
        self.law.reset()
        self.servos: np.ndarray | None = None
        self._heading = self._side = self._height = self.turns = np.zeros(0)

    def see(self, inputs: Inputs) -> np.ndarray:
        """Take what was sent before a control step; where servos and motors are then, shape (n, k)."""
        self.servos = self.law.servos_after(inputs)
        return self.servos

    def stop(self, which: np.ndarray, now: RigidBodyState, stops_at: np.ndarray) -> None:
        """Choose anew along which line some craft fly on, and how high.

        Args:
            which: True for these, shape (n,).
            now: Of all, shapes (n,).
            stops_at: Which way each shall turn, as in `turns`, shape (n,).
        """
        state = SpatialState.from_rigid(now)
        if len(self._heading) != len(which):
            self._heading = self._side = self._height = self.turns = np.zeros(len(which))
        self.turns = np.where(which, 0.0, self.turns)
        self._heading = np.where(which, np.arctan2(state.vy, state.vx), self._heading)
        side = self.along(state, self._heading).y
        self._side = np.where(which, side, self._side)
        self._height = np.where(which, self.held(state), self._height)
        self.turn(which & (stops_at != 0.0), stops_at)
        self.law.begin(which)

    def turn(self, which: np.ndarray, way: np.ndarray) -> None:
        """Let some craft turn from now on, shape (n,), as in `turns`."""
        self.turns = np.where(which, way, self.turns)
        low = np.where(which, self._floor + self._higher, 0.0)
        self._height = np.maximum(self._height, low)

    def free(self, which: np.ndarray) -> None:
        """Leave some craft to their controllers, shape (n,)."""
        self.turns = np.where(which, 0.0, self.turns)

    def held(self, state: SpatialState) -> np.ndarray:
        """Height that a craft would hold from now on, shape (n,) [m]."""
        return np.asarray(np.maximum(state.z, self._floor))

    def along(self, state: SpatialState, heading: np.ndarray) -> SpatialState:
        """States in worlds whose x axis has a heading, shapes (n,)."""
        c, s, zero = np.cos(heading), np.sin(heading), np.zeros_like(heading)
        back = from_euler(zero, zero, -heading)
        x, y = c * state.x + s * state.y, c * state.y - s * state.x
        vx, vy = c * state.vx + s * state.vy, c * state.vy - s * state.vx
        return SpatialState(x, y, state.z, *product(back, state.quat), vx, vy, state.vz, *state.rate)

    def aim(self, side: np.ndarray, height: np.ndarray, turns: np.ndarray | float = 0.0) -> Aim:
        """Level flight along a line, each shape (n,) [m], or a turn as in `turns`."""
        place = np.stack((side, height), axis=-1)
        bend = np.zeros_like(place)
        bend[:, 0] = turns * self._bend
        return Aim(place, np.zeros_like(place), bend)

    def command(self, inputs: Inputs, estimate: ActuatorEstimate | None) -> np.ndarray:
        """Commands of level flight, before the actuators' limits, shape (n, m); `see` the inputs first."""
        assert self.servos is not None, "the inputs were not seen"
        state = SpatialState.from_rigid(inputs.state.to_rigid())
        turning = self.turns != 0.0
        own = self.along(state, np.where(turning, np.arctan2(state.vy, state.vx), self._heading))
        side = np.where(turning, own.y, self._side)
        return self.law.answer(own, self.aim(side, self._height, self.turns), self.servos)
