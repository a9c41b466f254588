"""Stay with a pose that wanders through space."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, Self

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.attitude import from_euler, product, uniform_attitude, uniform_direction
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks.goal import Goal
from fulmar_core.tasks.goal_words import number
from fulmar_core.tasks.moving_pose import MovingPose
from fulmar_core.tasks.references.named_paths import named_path
from fulmar_core.tasks.references.planned_flight import LOOKS_AHEAD, Flight, Pace, planned_flight, poses_along
from fulmar_core.tasks.terms import Range

STEP_S = 0.1  # of the walk [s]
USUAL_PACE = Pace(speed=0.2)


@dataclass(frozen=True)
class Walk:
    """A random walk of a pose whose x axis points where it goes; it rolls nowhere.

    `orbital_waypoint_navigation` of AndrejOrsula/space_robotics_bench, for bodies with 0.07 m/s² instead of 0.3: a
    direction and a speed are wished for, and every 0.1 s the true ones keep a share of what they were.
    """

    speed: Range  # that is wished for; no more than the robot's own [m/s]
    hold_s: float  # time of one wish [s]
    direction_smoothing: float  # share that a direction keeps in 0.1 s [-]
    speed_smoothing: float  # same of the speed [-]
    box: float  # beyond this distance from the middle along any axis the wish is to go back [m]

    def __post_init__(self) -> None:
        if not 0.0 <= self.speed[0] <= self.speed[1] or min(self.hold_s, self.box) <= 0.0:
            raise ValueError(
                "'speed' must be [low, high] with 0 <= low <= high, hold_s and box greater than 0."
            )
        if not all(0.0 <= share < 1.0 for share in (self.direction_smoothing, self.speed_smoothing)):
            raise ValueError("smoothing must lie in [0, 1).")

    def draw(self, draws: Draws, *, over_s: float, spacing_s: float, most: float) -> np.ndarray:
        """Draw walks from the middle, no faster than `most` [m/s].

        Returns:
            Poses so far apart in time, up to the first one at or after `over_s`, shape (worlds, k, 7).
        """
        steps = round(spacing_s / STEP_S)
        count, wishes = steps * (1 + int(np.ceil(over_s / spacing_s))), int(np.ceil(over_s / self.hold_s)) + 1
        numbers = np.asarray(draws.uniform(0.0, 1.0, wishes + 1, 3))
        ways = np.stack(uniform_direction(numbers[..., 0], numbers[..., 1]), axis=-1)
        low, high = (min(speed, most) for speed in self.speed)
        speeds = low + (high - low) * numbers[..., 2]
        x, speed, roll = ways[:, -1], speeds[:, 0], 2.0 * np.pi * numbers[:, -1, 2]
        place, quat, poses = np.zeros_like(x), _towards(x, roll), []
        for step in range(count):
            if step % steps == 0:
                poses.append(np.concatenate((place, quat), axis=-1))
            wish = min(int(step * STEP_S / self.hold_s), wishes - 1)
            way = np.where(np.abs(place) > self.box, -np.sign(place), ways[:, wish])
            before, x = x, _unit(self.direction_smoothing * x + (1.0 - self.direction_smoothing) * way)
            speed = self.speed_smoothing * speed + (1.0 - self.speed_smoothing) * speeds[:, wish]
            place, quat = place + STEP_S * speed[:, None] * x, _carried(quat, before, x)
        return np.stack(poses, axis=1)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9))


def _towards(x: np.ndarray, roll: np.ndarray) -> np.ndarray:
    """Attitudes whose x axis points there, rolled about it, shape (n, 4)."""
    yaw, pitch = np.arctan2(x[:, 1], x[:, 0]), -np.arcsin(np.clip(x[:, 2], -1.0, 1.0))
    return np.stack(from_euler(roll, pitch, yaw), axis=-1)


def _carried(quat: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Attitudes turned by the least rotation from one direction to another, shape (n, 4)."""
    axis, cosine = np.cross(before, after), np.sum(before * after, axis=-1)
    least = _unit(np.concatenate((axis, 1.0 + cosine[:, None]), axis=-1))
    return np.stack(product(tuple(least.T), tuple(quat.T)), axis=-1)


@dataclass(frozen=True)
class PursuitStart:
    """Where episodes begin, at rest: so far from the first pose of the target in any direction, turned anyhow [m]."""

    distance: Range
    training_distance: Range

    def __post_init__(self) -> None:
        for low, high in (self.distance, self.training_distance):
            if not 0.0 <= low <= high:
                raise ValueError(
                    f"distances must be [low, high] with 0 <= low <= high, found [{low}, {high}]."
                )


@dataclass(frozen=True, kw_only=True)
class FollowPose3d(MovingPose):
    """Follow a random walk, or one round of a path with x along it; all of it comes on `goal_path` when it begins."""

    kind: Literal["follow_pose_3d"]
    start: PursuitStart
    walk: Walk
    path: str = ""  # one of `named_paths.NAMED`, about the origin; empty: the walk
    radius: float = 1.8  # of a path, to its nearest place [m]
    pace: Pace = USUAL_PACE  # of a path

    def __post_init__(self) -> None:
        super().__post_init__()
        if abs(self.spacing_s / STEP_S - round(self.spacing_s / STEP_S)) > 1e-6:
            raise ValueError(f"'spacing_s' must be a multiple of {STEP_S:g} s.")
        if self.radius <= 0.0:
            raise ValueError("'radius' must be greater than 0.")
        if self.path:
            named_path(self.path, self.radius)

    def along(self, path: str) -> Self:
        """See `Task.along`."""
        return replace(self, path=path)

    def said(self, goal: Goal) -> str:
        """See `Task.said`."""
        long_s = number(self.spacing_s * (len(goal.targets) - 1))
        return f"the {self.path}, {long_s} s" if self.path else f"a random walk of {long_s} s"

    def flight(self, robot: Robot) -> Flight:
        """The path that a robot flies."""
        return planned_flight(
            self.path, self.radius, self.pace,
            facing="along_path", looks=LOOKS_AHEAD, can=robot.performance,
        )  # fmt: skip

    def episode_of(self, robot: Robot) -> float:
        """See `Task.episode_of`: of a path, one whole round."""
        step = robot.timing.control_s
        return step * math.ceil(self.flight(robot).duration_s / step) if self.path else self.episode_s

    def check(self, robot: Robot) -> None:
        """See `Task.check`, and of a path `Flight.check`."""
        super().check(robot)
        if self.path:
            self.flight(robot).check(robot, self.keep_outs, f"the {self.path}")

    def _poses(self, draws: Draws, robot: Robot, *, training: bool) -> np.ndarray:
        """What the target does in some worlds, shape (worlds, k, 7)."""
        over_s = self.episode_s + 1.0
        if not self.path:
            return self.walk.draw(
                draws, over_s=over_s, spacing_s=self.spacing_s, most=robot.performance.speed
            )
        flight = self.flight(robot)
        over_s = over_s if training else flight.duration_s
        times = self.spacing_s * np.arange(1 + math.ceil(over_s / self.spacing_s))
        begin = np.asarray(draws.uniform(0.0, 1.0))
        return poses_along((flight,), np.zeros(len(begin), dtype=int), begin, times)

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[SpatialState, Goal]:
        """Draw a start at rest, and a walk that is longer than the episode."""
        low, high = self.start.training_distance if training else self.start.distance
        distance, numbers = draws.uniform(low, high), draws.uniform(0.0, 1.0, 5)
        aside = uniform_direction(numbers[:, 0], numbers[:, 1])
        quat = uniform_attitude(*(numbers[:, i] for i in range(2, 5)), tilt_deg=robot.kind.tilt_deg)
        poses = self._poses(draws, robot, training=training)
        xp = array_namespace(distance)
        goal = self.goal_through(xp.asarray(poses), xp.zeros_like(distance))
        x, y, z = (goal.targets[:, 0, i] + distance * part for i, part in enumerate(aside))
        return SpatialState.at_rest((x, y, z), quat), goal
