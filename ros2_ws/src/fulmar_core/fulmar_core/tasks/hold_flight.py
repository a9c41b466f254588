"""Hold an attitude or an airspeed, far above the ground; from level flight, or from an upset."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar, Literal, Self

import numpy as np

from fulmar_core.dynamics.flight_trim import Trim, find_trim, nominal_flight
from fulmar_core.robots.kinds.aircraft import AIRCRAFT
from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.attitude import (
    euler_of,
    exponential,
    from_euler,
    length,
    product,
    scaled,
    turn,
    uniform_direction,
)
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState, quat_of
from fulmar_core.tasks.flight_terms import angle_of_attack, check_above_ground, is_lost, tilt_error
from fulmar_core.tasks.goal import Goal, goals_at
from fulmar_core.tasks.goal_words import number
from fulmar_core.tasks.task import FileTask
from fulmar_core.tasks.terms import Errors, weighted_sum

Range = tuple[float, float]
MOTION_TERMS = (
    "height", "climb", "angle_of_attack", "sideslip", "roll", "pitch", "roll_rate", "pitch_rate", "turn_rate",
)  # fmt: skip
ATTITUDE_TERMS = ("roll_error", "pitch_error", "fine_roll_error", "fine_pitch_error", "speed_error")
AIRSPEED_TERMS = ("speed_error", "fine_speed_error", "wanted_speed")
HIGH, FAST, QUICK = 100.0, 10.0, 0.2  # scales of heights [m], climb rates [m/s] and turn rates [rad/s]
FINE_RAD, FINE_SPEED = 0.1, 0.5  # where magnified errors saturate [rad, m/s]


@dataclass(frozen=True)
class HoldStart:
    """How episodes begin: in level flight at cruising speed, turned, with the velocity, so far about any axis."""

    height: Range  # above the ground [m]
    tilt_deg: Range = (0.0, 0.0)  # from level flight [deg]

    def __post_init__(self) -> None:
        for name in ("height", "tilt_deg"):
            low, high = getattr(self, name)
            if not 0.0 <= low <= high:
                raise ValueError(
                    f"'{name}' must be [low, high] with 0 <= low <= high, found [{low}, {high}]."
                )
        if self.height[0] == 0.0 or self.tilt_deg[1] > 180.0:
            raise ValueError("'height' must be greater than 0, and 'tilt_deg' at most 180.")


@dataclass(frozen=True)
class HoldReward:
    """Weights of the reward, per control step."""

    near: float  # times exp(-error / scale): 0.3 rad of an attitude, 2 m/s of a speed
    nearer: float  # same, of a tenth of the scale
    speed: float  # times exp(-|speed error| / 2 m/s)
    turning: float  # times -|turn rate|
    crash: float  # once, subtracted, when the craft is lost


@dataclass(frozen=True)
class _HoldFlight(FileTask[SpatialState]):
    """What both tasks share; see there."""

    start: HoldStart
    reward_weights: HoldReward

    state_type = SpatialState
    kinds = (AIRCRAFT,)
    scale: ClassVar[float]  # of errors in the reward [rad or m/s]

    cruise: float = 0.0  # speed of the craft, as in `fitted`; 0 in a file [m/s]

    def fitted(self, robot: Robot) -> Self:
        """The task with the cruising speed of a craft; see `Task.fitted`."""
        return replace(self, cruise=robot.airframe.speed) if robot.airframe is not None else self

    def at_height(self, height: float) -> Self:
        """See `Task.at_height`."""
        return replace(self, start=replace(self.start, height=(height, height)))

    def check(self, robot: Robot) -> None:
        """See `Task.check`; and the hull is in the air at the lowest start.

        Raises:
            ConfigError: As in `Task.check`, or the lowest start lies on the ground.
        """
        super().check(robot)
        check_above_ground(self.name, robot, self.start.height[0])

    def check_running(self, robot: Robot) -> None:
        """See `Task.check_running`: what flies may have begun higher."""
        self.check_kind(robot)

    def farthest_start(self, *, training: bool) -> tuple[str, float]:
        """See `Task.farthest_start`; nothing here is a way to a place."""
        return "", 0.0

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[SpatialState, Goal]:
        """Draw starts and goals; see `Task.draw`."""
        trim = find_trim(robot, robot.wings.speed, None)
        height = draws.uniform(*self.start.height)
        tilt = math.pi / 180.0 * draws.uniform(*self.start.tilt_deg)
        about = uniform_direction(draws.uniform(0.0, 1.0), draws.uniform(0.0, 1.0))
        zero = 0.0 * height
        upset = exponential(scaled(tilt, about))
        quat = product(upset, nominal_flight(robot, height).quat)
        # Angles of attack and sideslip are those of level flight: the velocity is turned with the craft.
        state = SpatialState(
            zero, zero, height, *quat, *turn(upset, (zero + trim.speed, zero, zero)), zero, zero, zero
        )
        return state, goals_at(np.asarray(self._targets(draws, trim, height)))

    @abstractmethod
    def _targets(self, draws: Draws, trim: Trim, height: Array) -> Array:
        """Draw targets, shape (worlds, 7 or 6)."""

    def distance_from_goal(self, state: SpatialState, goal: Goal) -> Array | None:
        """See `Task.distance_from_goal`: a craft that holds an attitude goes anywhere."""
        return None

    def collides(self, state: SpatialState, goal: Goal, robot: Robot) -> Array | None:
        """Whether the craft is lost; see `Task.collides`."""
        return is_lost(state, robot)

    def penalty(self, state: SpatialState, goal: Goal, robot: Robot) -> Array | None:
        """What the loss of the craft costs a learner; see `Task.penalty`."""
        lost = is_lost(state, robot)
        return self.reward_weights.crash * array_namespace(state.z).astype(lost, state.z.dtype)

    def _motion(self, state: SpatialState) -> tuple[Array, ...]:
        """`MOTION_TERMS`; angles of attack and sideslip are against still air."""
        _, left, _ = state.velocity_in_body
        roll, pitch, _ = euler_of(state.quat)
        speed = clip(length(state.velocity), 1.0, None)
        rates = (rate / QUICK for rate in state.rate)
        return (
            state.z / HIGH, state.vz / FAST, 10.0 * angle_of_attack(state), 10.0 * left / speed,
            2.0 * roll, 5.0 * pitch, *rates,
        )  # fmt: skip

    @abstractmethod
    def _error(self, state: SpatialState, goal: Goal) -> Array:
        """What the reward is about, shape (...,) >= 0 [rad or m/s]."""

    @abstractmethod
    def _speed_error(self, state: SpatialState, goal: Goal) -> Array:
        """Wanted minus true speed, shape (...,) [m/s]."""

    def reward(self, before: SpatialState, after: SpatialState, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step; see `Task.reward`."""
        xp, w, error = array_namespace(after.x), self.reward_weights, self._error(after, ended)
        return weighted_sum(
            (w.near, lambda: xp.exp(-error / self.scale)),
            (w.nearer, lambda: xp.exp(-error / (0.1 * self.scale))),
            (w.speed, lambda: xp.exp(-xp.abs(self._speed_error(after, ended)) / 2.0)),
            (-w.turning, lambda: length(after.rate)),
            zero=xp.zeros_like(error),
        )


@dataclass(frozen=True)
class HoldAttitude(_HoldFlight):
    """Hold a bank and a pitch at cruising speed, whatever the heading (`goal_pose`, whose place does not count).

    The goal's attitude is that of level flight, pitched up and then banked.
    """

    kind: Literal["hold_attitude"] = "hold_attitude"
    bank_deg: Range = (0.0, 0.0)  # positive: right wing down [deg]
    climb_deg: Range = (0.0, 0.0)  # by which the nose is above that of level flight [deg]

    goal_topic: ClassVar[str] = "goal_pose"
    observation_names: ClassVar[tuple[str, ...]] = (*ATTITUDE_TERMS, *MOTION_TERMS)
    scale: ClassVar[float] = 0.3

    def __post_init__(self) -> None:
        for name, most in (("bank_deg", 60.0), ("climb_deg", 45.0)):
            low, high = getattr(self, name)
            if not -most <= low <= high <= most:
                raise ValueError(
                    f"'{name}' must be [low, high] within ±{most:g}, with low <= high, found [{low}, {high}]."
                )

    def _targets(self, draws: Draws, trim: Trim, height: Array) -> Array:
        bank, climb = (math.pi / 180.0 * draws.uniform(*edges) for edges in (self.bank_deg, self.climb_deg))
        xp, zero = array_namespace(height), 0.0 * height
        level = trim.state.mapped(lambda part: zero + float(part)).quat
        quat = product(from_euler(bank, -climb, zero), level)
        return xp.stack((zero, zero, height, *quat), axis=-1)

    def said(self, goal: Goal) -> str:
        """See `Task.said`."""
        *_, roll, pitch, _yaw = self.state_type.written(goal.current)
        return f"roll {number(roll, 2)}, pitch {number(pitch, 2)} degrees, any heading"

    def errors(self, state: SpatialState, goal: Goal) -> Errors:
        """Angle between the wanted and the true attitude, the heading left out."""
        return Errors(attitude=self._error(state, goal))

    def _error(self, state: SpatialState, goal: Goal) -> Array:
        return length(tilt_error(state.quat, quat_of(goal.current)))

    def _speed_error(self, state: SpatialState, goal: Goal) -> Array:
        return self.cruise - length(state.velocity)

    def observe(self, state: SpatialState, goal: Goal) -> tuple[Array, ...]:
        """What every controller of this task sees; see `Task.observe`."""
        roll, pitch, _ = tilt_error(state.quat, quat_of(goal.current))
        fine = (clip(part / FINE_RAD, -1.0, 1.0) for part in (roll, pitch))
        return (roll, pitch, *fine, 0.1 * self._speed_error(state, goal), *self._motion(state))


@dataclass(frozen=True)
class HoldAirspeed(_HoldFlight):
    """Hold an airspeed in level flight, whatever the heading; the speed is the x part of `goal_velocity`."""

    kind: Literal["hold_airspeed"] = "hold_airspeed"
    speed: Range = (1.0, 1.0)  # of the cruising speed [-]

    goal_topic: ClassVar[str] = "goal_velocity"
    observation_names: ClassVar[tuple[str, ...]] = (*AIRSPEED_TERMS, *MOTION_TERMS)
    scale: ClassVar[float] = 2.0

    def __post_init__(self) -> None:
        if not 0.5 <= self.speed[0] <= self.speed[1] <= 2.0:
            raise ValueError(
                f"'speed' must be [low, high] with 0.5 <= low <= high <= 2, found {list(self.speed)}."
            )

    def _targets(self, draws: Draws, trim: Trim, height: Array) -> Array:
        zero = 0.0 * height
        speed = trim.speed * draws.uniform(*self.speed)
        return array_namespace(height).stack((speed, zero, zero, zero, zero, zero), axis=-1)

    def said(self, goal: Goal) -> str:
        """See `Task.said`."""
        return f"{number(goal.current[0])} m/s through the air, level"

    def errors(self, state: SpatialState, goal: Goal) -> Errors:
        """Errors of the speed with the climb rate, and the turn rate."""
        return Errors(velocity=self._error(state, goal), rate=length(state.rate))

    def _error(self, state: SpatialState, goal: Goal) -> Array:
        slow = self._speed_error(state, goal)
        return array_namespace(slow).sqrt(slow * slow + state.vz * state.vz)

    def _speed_error(self, state: SpatialState, goal: Goal) -> Array:
        return goal.current[..., 0] - length(state.velocity)

    def observe(self, state: SpatialState, goal: Goal) -> tuple[Array, ...]:
        """What every controller of this task sees; see `Task.observe`."""
        slow, wanted = self._speed_error(state, goal), goal.current[..., 0]
        relative = wanted / max(self.cruise, 1.0) - 1.0
        return (0.1 * slow, clip(slow / FINE_SPEED, -1.0, 1.0), relative, *self._motion(state))
