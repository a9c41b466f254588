"""Fly along a reference: hold a height, or follow a path that changes height and place to the side over time."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import ClassVar, Literal

import numpy as np

from fulmar_core.dynamics.flight_trim import nominal_flight
from fulmar_core.robots.kinds.aircraft import AIRCRAFT
from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace, clip, is_number, is_single
from fulmar_core.states.attitude import euler_of, exponential, length, product, scaled, uniform_direction
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks.flight_terms import angle_of_attack, check_above_ground, is_lost
from fulmar_core.tasks.goal import Goal, no_obstacles
from fulmar_core.tasks.goal_words import number
from fulmar_core.tasks.references.flight_paths import PATHS, through
from fulmar_core.tasks.task import FileTask
from fulmar_core.tasks.terms import Errors, weighted_sum

Range = tuple[float, float]
NOW = "reference"  # among the things of a goal: time [s], place [m] and its rate [m/s] now, seven numbers
TERMS = (
    "height_error", "fine_height_error", "finest_height_error", "side_error", "fine_side_error",
    "climb_error", "drift_error", "reference_climb", "reference_drift", "reference_height", "speed_error",
    "angle_of_attack", "sideslip", "roll", "pitch", "heading", "roll_rate", "pitch_rate", "turn_rate",
)  # fmt: skip
COARSE, FINE, FINEST = 1.0, 0.3, 0.05  # where errors saturate [m]
FAST, QUICK = 1.0, 0.2  # scales of climb rates [m/s] and turn rates [rad/s]


@dataclass(frozen=True)
class FlightStart:
    """How episodes begin: in level flight at the reference's first place, and off it by so much."""

    height: Range = (0.0, 0.0)  # above the reference [m]
    training_height: Range = (0.0, 0.0)  # same, in training [m]
    side: float = 0.0  # largest way to either side [m]
    tilt_deg: Range = (0.0, 0.0)  # turned about any axis from the attitude of level flight [deg]

    def __post_init__(self) -> None:
        for name in ("height", "training_height", "tilt_deg"):
            low, high = getattr(self, name)
            if low > high:
                raise ValueError(f"'{name}' must be [low, high] with low <= high, found [{low}, {high}].")
        if self.side < 0.0 or self.tilt_deg[0] < 0.0:
            raise ValueError("'side' and 'tilt_deg' must not be negative.")


@dataclass(frozen=True)
class FlightReward:
    """Weights of the reward, per control step; e is the height error, s the error to the side."""

    near: float  # times exp(-e / 0.5 m)
    nearer: float  # times exp(-e / 0.08 m)
    side: float  # times (exp(-|s| / 0.3 m) + exp(-|s| / 3 m)) / 2: the wider part leads back those that drift away
    speed: float  # times exp(-|speed error| / 2 m/s)
    upright: float  # times cos(roll)
    turning: float  # times -|turn rate|
    crash: float  # once, subtracted, when the craft is lost
    # Times (exp(-d / 0.5 m/s) + exp(-d / 3 m/s)) / 2, with d the error of the speed to the side: leads into ramps.
    drift: float = 0.0


@dataclass(frozen=True)
class FollowReference(FileTask[SpatialState]):
    """Follow places that lie `spacing_s` apart in time, all of them known from the start (`goal_path`).

    Errors are across the flight: to the side and in height. How far along x the craft is does not count.
    """

    kind: Literal["follow_reference"]
    start: FlightStart
    reward_weights: FlightReward
    # "hold", one of `tasks.references.flight_paths.PATHS`, or through the waypoints of the file
    reference: Literal["hold", "a", "b", "c", "d", "e", "f", "waypoints"] = "hold"
    height: Range = (1.0, 1.0)  # that `hold` draws from [m]
    spacing_s: float = 0.1  # between two places of the path [s]
    waypoints: tuple[tuple[float, float, float], ...] = ()  # ahead of the start, to the left and up [m]

    goal_topic: ClassVar[str] = "goal_path"
    state_type = SpatialState
    kinds = (AIRCRAFT,)
    observes_numbers = True
    observation_names: ClassVar[tuple[str, ...]] = TERMS

    def __post_init__(self) -> None:
        if not 0.0 < self.height[0] <= self.height[1]:
            raise ValueError(f"'height' must be [low, high] with 0 < low <= high, found {list(self.height)}.")
        if self.spacing_s <= 0.0 or self.episode_s <= 0.0:
            raise ValueError("spacing_s and episode_s must be greater than 0.")
        if (self.reference == "waypoints") is not bool(self.waypoints):
            raise ValueError("'waypoints' go with 'reference: waypoints', and that with them.")
        ahead = [place[0] for place in self.waypoints]
        if any(b <= a for a, b in pairwise(ahead)):
            raise ValueError("each of 'waypoints' must lie further ahead than the one before.")

    def said(self, goal: Goal) -> str:
        """See `Task.said`."""
        first, count = goal.targets[0], len(goal.targets)
        words = f"height {number(first[2])} m"
        if count == 1:
            return words
        return f"a path of {number(self.spacing_s * (count - 1))} s ({self.title}), from {words}"

    def at_height(self, height: float) -> FollowReference:
        """See `Task.at_height`."""
        if self.reference != "hold":
            return super().at_height(height)
        return replace(self, height=(height, height))

    def farthest_start(self, *, training: bool) -> tuple[str, float]:
        """See `Task.farthest_start`."""
        name = "training_height" if training else "height"
        return f"start.{name}", max(abs(edge) for edge in getattr(self.start, name))

    def check(self, robot: Robot) -> None:
        """See `Task.check`; and the reference lies where the craft can be.

        Raises:
            ConfigError: As in `Task.check`, or the lowest start lies in the water.
        """
        super().check(robot)
        if self.reference == "hold":
            higher = " Give a greater height, as `fulmar run` takes by --height."
            check_above_ground(self.name, robot, self.height[0] + self.start.height[0], otherwise=higher)
        if self.waypoints:
            check_above_ground(self.name, robot, self.waypoints[0][2] + self.start.height[0])
            check_above_ground(self.name, robot, min(place[2] for place in self.waypoints), "leads down to")

    def check_running(self, robot: Robot) -> None:
        """See `Task.check_running`: what flies may have begun higher."""
        self.check_kind(robot)

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[SpatialState, Goal]:
        """Draw starts and goals; see `Task.draw`."""
        held = draws.uniform(*self.height)
        low, high = self.start.training_height if training else self.start.height
        above, aside = draws.uniform(low, high), draws.uniform(-self.start.side, self.start.side)
        tilt = draws.uniform(*self.start.tilt_deg)
        about = uniform_direction(draws.uniform(0.0, 1.0), draws.uniform(0.0, 1.0))
        xp = array_namespace(held)
        goal = self._goal(held, robot.wings.speed)
        first = goal.targets[:, 0]
        zero = xp.zeros_like(held)
        turned = exponential(scaled(math.pi / 180.0 * tilt, about))
        place = zero, first[:, 1] + aside, first[:, 2] + above
        quat = product(nominal_flight(robot, place[2]).quat, turned)
        state = SpatialState(*place, *quat, zero + robot.wings.speed, *(zero for _ in range(5)))
        return state, goal

    def _goal(self, held: Array, speed: float) -> Goal:
        """Places along the reference; of a held height one is enough."""
        xp, worlds = array_namespace(held), len(held)
        count = 1 if self.reference == "hold" else 2 + math.ceil(self.episode_s / self.spacing_s)
        times = self.spacing_s * np.arange(count)
        targets = np.zeros((worlds, count, 7))
        targets[..., 0], targets[..., 6] = speed * times, 1.0
        if self.reference == "hold":
            targets[:, :, 2] = np.asarray(held)[:, None]
        else:
            side, above = through(self.waypoints, speed) if self.waypoints else PATHS[self.reference]
            targets[..., 1], targets[..., 2] = side(times), above(times)
        goal = Goal(xp.asarray(targets), xp.zeros_like(held), no_obstacles(worlds))
        return self.begun(goal, None)

    def begun(self, goal: Goal, state: SpatialState | None) -> Goal:
        """The reference at its first place; see `Task.begun`."""
        zero = 0.0 * goal.targets[..., 0, 0]
        return replace(goal, things={**goal.things, NOW: self._now(goal, zero)})

    def _now(self, goal: Goal, time_s: Array) -> Array:
        """Time, place and rate of the reference, between its places in a straight line, shape (..., 7)."""
        targets = goal.targets
        xp, last = array_namespace(targets), targets.shape[-2] - 1
        here = targets[..., 0, :]
        zero = 0.0 * here[..., 0]
        time = time_s + zero
        if last and is_single(time):
            return self._of_one(targets[0], float(time[0]))
        if last == 0:
            return xp.stack((time, *(here[..., i] for i in range(3)), zero, zero, zero), axis=-1)
        share = clip(time / self.spacing_s, 0.0, float(last))
        before = clip(xp.floor(share + 1e-6), 0.0, last - 1.0)
        which = xp.astype(before, xp.int64)[..., None, None]
        low = xp.take_along_axis(targets, which, axis=-2)[..., 0, :]
        high = xp.take_along_axis(targets, which + 1, axis=-2)[..., 0, :]
        part, going = share - before, xp.astype(time < last * self.spacing_s, targets.dtype)
        place = (low[..., i] + part * (high[..., i] - low[..., i]) for i in range(3))
        rate = (going * (high[..., i] - low[..., i]) / self.spacing_s for i in range(3))
        return xp.stack((time, *place, *rate), axis=-1)

    def _of_one(self, targets: np.ndarray, time: float) -> np.ndarray:
        """As `_now`, of one craft that follows two places or more, shape (1, 7)."""
        last = len(targets) - 1
        share = clip(time / self.spacing_s, 0.0, float(last))
        before = clip(float(math.floor(share + 1e-6)), 0.0, last - 1.0)
        ends = targets[int(before) : int(before) + 2, :3].tolist()
        part, going = share - before, 1.0 if time < last * self.spacing_s else 0.0
        place = [low + part * (high - low) for low, high in zip(*ends, strict=True)]
        rate = [going * (high - low) / self.spacing_s for low, high in zip(*ends, strict=True)]
        return np.array([[time, *place, *rate]])

    def advance(self, goal: Goal, state: SpatialState, time_s: Array) -> Goal:
        """The reference moves on; see `Task.advance`."""
        now = self._now(goal, time_s)
        xp, last = array_namespace(now), goal.targets.shape[-2] - 1
        done = clip(xp.floor(now[..., 0] / self.spacing_s + 1e-6), 0.0, float(last))
        return replace(goal, done=xp.astype(done, goal.done.dtype), things={**goal.things, NOW: now})

    def distance_from_goal(self, state: SpatialState, goal: Goal) -> Array | None:
        """Distance across the flight; see `Task.distance_from_goal`."""
        return self.errors(state, goal).position

    def errors(self, state: SpatialState, goal: Goal) -> Errors:
        """Distance from the reference across the flight."""
        side, above = off_reference(state, goal)
        return Errors(position=array_namespace(side).sqrt(side * side + above * above))

    def observe(self, state: SpatialState, goal: Goal) -> tuple[Array, ...]:
        """What every controller of this task sees, all of it near 1; see `Task.observe`.

        Angles of attack and sideslip are against still air. Of one craft the state may be in plain numbers.
        """
        now, wanted = reference_of(goal), self.speed_of(goal)
        _, _, y, z, _, rate_y, rate_z = (now[..., i] for i in range(7))
        if is_number(state.x):
            wanted = float(wanted[0])
            _, _, y, z, _, rate_y, rate_z = now[0].tolist()
        side, above = y - state.y, z - state.z
        climb, drift = rate_z - state.vz, rate_y - state.vy
        left = state.velocity_in_body[1]
        roll, pitch, yaw = euler_of(state.quat)
        speed = length(state.velocity)
        return (
            clip(above / COARSE, -3.0, 3.0), clip(above / FINE, -1.0, 1.0), clip(above / FINEST, -1.0, 1.0),
            clip(side / COARSE, -3.0, 3.0), clip(side / FINE, -1.0, 1.0),
            climb / FAST, drift / FAST, rate_z / FAST, rate_y / FAST, 0.2 * z,
            0.1 * (wanted - speed), 10.0 * angle_of_attack(state), 10.0 * left / clip(speed, 1.0, None),
            2.0 * roll, 5.0 * pitch, 5.0 * yaw, *(rate / QUICK for rate in state.rate),
        )  # fmt: skip

    def speed_of(self, goal: Goal) -> Array:
        """Speed along x that a path asks for; that of the craft where it is one place [m/s]."""
        if goal.targets.shape[-2] == 1:
            return goal.targets[..., 0, 0] + self.cruise
        return (goal.targets[..., 1, 0] - goal.targets[..., 0, 0]) / self.spacing_s

    cruise: float = 0.0  # of the craft, as in `fitted`; 0 in a file [m/s]

    def fitted(self, robot: Robot) -> FollowReference:
        """The task with the cruising speed of a craft; see `Task.fitted`."""
        return replace(self, cruise=robot.airframe.speed) if robot.airframe is not None else self

    def reward(self, before: SpatialState, after: SpatialState, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step; see `Task.reward`."""
        xp, w = array_namespace(after.x), self.reward_weights
        s, e = (xp.abs(part) for part in off_reference(after, ended))
        slow = xp.abs(self.speed_of(ended) - length(after.velocity))

        def drift() -> Array:
            return xp.abs(reference_of(ended)[..., 5] - after.vy)

        return weighted_sum(
            (w.near, lambda: xp.exp(-e / 0.5)),
            (w.nearer, lambda: xp.exp(-e / 0.08)),
            (0.5 * w.side, lambda: xp.exp(-s / 0.3) + xp.exp(-s / 3.0)),
            (w.speed, lambda: xp.exp(-slow / 2.0)),
            (w.upright, lambda: xp.cos(euler_of(after.quat)[0])),
            (-w.turning, lambda: length(after.rate)),
            (0.5 * w.drift, lambda: xp.exp(-drift() / 0.5) + xp.exp(-drift() / 3.0)),
            zero=xp.zeros_like(e),
        )

    def collides(self, state: SpatialState, goal: Goal, robot: Robot) -> Array | None:
        """Whether the hull touches the water, or the craft is stalled beyond recovery; see `Task.collides`."""
        return is_lost(state, robot)

    def penalty(self, state: SpatialState, goal: Goal, robot: Robot) -> Array | None:
        """What the loss of the craft costs a learner; see `Task.penalty`."""
        touching = self.collides(state, goal, robot)
        return self.reward_weights.crash * array_namespace(state.z).astype(touching, state.z.dtype)


def off_reference(state: SpatialState, goal: Goal) -> tuple[Array, Array]:
    """Way to the reference, to the left and up, shapes (...,) [m]."""
    now = reference_of(goal)
    return now[..., 2] - state.y, now[..., 3] - state.z


def reference_of(goal: Goal) -> Array:
    """Time, place and rate of the reference now, shape (..., 7); of a goal that has not begun its first place."""
    if NOW in goal.things:
        return goal.things[NOW]
    first = goal.targets[..., 0, :]
    zero = 0.0 * first[..., 0]
    return array_namespace(first).stack((zero, *(first[..., i] for i in range(3)), zero, zero, zero), axis=-1)
