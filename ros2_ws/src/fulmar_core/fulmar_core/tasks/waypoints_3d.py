"""Tasks in space that visit waypoints one after another, as many as time allows."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.attitude import length, scaled, uniform_attitude, uniform_direction
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks.goal import Goal, no_obstacles
from fulmar_core.tasks.space_terms import (
    ATTITUDE_TERMS,
    AXES,
    MOTION_TERMS,
    ROTATION_TERMS,
    attitude_terms,
    goal_terms,
    motion_terms,
    place_errors,
    rotation_terms,
)
from fulmar_core.tasks.task import FileTask
from fulmar_core.tasks.terms import Errors

SEEN = ("goal", "next_goal")  # targets that a controller sees, in their order
CANDIDATES = 12  # places tried for each waypoint; that all leave the cube is rarer than one in a million


@dataclass(frozen=True)
class SpaceWaypoints:
    """A closed sequence of waypoints in a cube, with attitudes that are uniform over SO(3)."""

    count: int  # waypoints; after the last one the first comes again
    spacing: tuple[float, float]  # from each to the next [m]
    area: float  # side of the cube [m]

    def __post_init__(self) -> None:
        if self.count < 2 or not 0.0 < self.spacing[0] <= self.spacing[1] <= 0.5 * self.area:
            raise ValueError(
                "'count' must be at least 2, 'spacing' [low, high] with 0 < low <= high <= area / 2."
            )

    def draw(self, draws: Draws, *, tilt_deg: float) -> np.ndarray:
        """Draw poses that tilt no further [deg], shape (worlds, count, 7)."""
        half, worlds = 0.5 * self.area, np.arange(draws.worlds)
        places = [np.asarray(draws.uniform(-half, half, 3))]
        for _ in range(1, self.count):
            distance = np.asarray(draws.uniform(*self.spacing, CANDIDATES))
            towards = uniform_direction(
                draws.uniform(0.0, 1.0, CANDIDATES), draws.uniform(0.0, 1.0, CANDIDATES)
            )
            step = np.stack(scaled(distance, towards), axis=-1)
            here = places[-1][:, None, :]
            # A step that leaves the cube goes the other way: half of the side is at least as long as the step.
            candidates = here + np.where(np.abs(here + step) > half, -step, step)
            fits = np.all(np.abs(candidates) <= half, axis=-1)
            places.append(candidates[worlds, np.argmax(fits, axis=1)])
        numbers = draws.uniform(0.0, 1.0, self.count, 3)
        quat = uniform_attitude(*(numbers[..., i] for i in range(3)), tilt_deg=tilt_deg)
        return np.concatenate((np.stack(places, axis=1), np.stack(quat, axis=-1)), axis=-1)


@dataclass(frozen=True)
class SpaceWaypointReward:
    """Weights of the reward, per control step."""

    progress: float  # times metres come nearer to the current waypoint
    reached: float  # for each waypoint reached
    spin: float = 0.0  # cost of the turn rate [per rad/s]
    turn: float = 0.0  # times radians come nearer to its attitude
    joint: float = 0.0  # times exp(-d / 0.5 m - e / 0.5 rad): turned right when near


@dataclass(frozen=True, kw_only=True)
class SpaceWaypointTask(FileTask[SpatialState]):
    """Pass targets in their order; they arrive on `goal_path`."""

    start_distance: tuple[float, float]  # from the first target, in any direction [m]
    course: SpaceWaypoints
    reach: float  # radius within which a target counts as reached for a controller [m]
    reach_attitude_deg: float = 0.0  # same of the angle between attitudes; 0: any [deg]
    required: int = field()  # targets that make an episode a success
    reward_weights: SpaceWaypointReward

    goal_topic: ClassVar[str] = "goal_path"
    state_type = SpatialState
    turns: ClassVar[bool] = False  # whether the targets' attitudes count

    def __post_init__(self) -> None:
        if not 0.0 < self.reach <= self.tolerance.position:
            raise ValueError("'reach' must be greater than 0 and at most the tolerance of the position.")
        if self.turns and not 0.0 < self.reach_attitude_deg <= self.tolerance.attitude_deg:
            raise ValueError(
                "'reach_attitude_deg' must be greater than 0 and at most the tolerance of the attitude."
            )

    @property
    def observation_names(self) -> tuple[str, ...]:
        """How the robot moves, and where the next two targets are."""
        each = (*(f"direction_{axis}_in_body" for axis in AXES), "distance")
        if self.turns:
            each = (*each, *ATTITUDE_TERMS, *ROTATION_TERMS)
        return (*MOTION_TERMS, *(f"{target}_{name}" for target in SEEN for name in each))

    def farthest_start(self, *, training: bool) -> tuple[str, float]:
        """See `Task.farthest_start`."""
        return "start_distance", self.start_distance[1]

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[SpatialState, Goal]:
        """Draw a start at rest and closed waypoints."""
        tilt_deg = robot.kind.tilt_deg
        targets = self.course.draw(draws, tilt_deg=tilt_deg)
        distance, numbers = draws.uniform(*self.start_distance), draws.uniform(0.0, 1.0, 5)
        aside = uniform_direction(numbers[:, 0], numbers[:, 1])
        x, y, z = (targets[:, 0, i] + distance * aside[i] for i in range(3))
        quat = uniform_attitude(*(numbers[:, i] for i in range(2, 5)), tilt_deg=tilt_deg)
        worlds = draws.worlds
        return SpatialState.at_rest((x, y, z), quat), Goal(targets, np.zeros(worlds), no_obstacles(worlds))

    def observe(self, state: SpatialState, goal: Goal) -> tuple[Array, ...]:
        """What every controller of this task sees; see `Task.observe`."""
        terms = motion_terms(state)
        for further in range(len(SEEN)):
            target = goal.ahead(further)
            way = goal_terms(state, target)
            distance = length(way)
            terms = (*terms, *scaled(1.0 / clip(distance, 1e-3, None), way), distance)
            if self.turns:
                terms = (*terms, *attitude_terms(state, target), *rotation_terms(state, target))
        return terms

    def advance(self, goal: Goal, state: SpatialState, time_s: Array) -> Goal:
        """A target that is passed is done."""
        return self._passed(goal, state, self.reach, self.reach_attitude_deg)

    def counted(self, goal: Goal, state: SpatialState, time_s: Array) -> Goal:
        """As `advance`, within the tolerance of evaluations."""
        return self._passed(goal, state, self.tolerance.position, self.tolerance.attitude_deg)

    def _passed(self, goal: Goal, state: SpatialState, radius: float, angle_deg: float) -> Goal:
        errors = self.errors(state, goal)
        there = errors.position < radius
        if self.turns:
            there = there & (errors.attitude < math.radians(angle_deg))
        return replace(goal, done=goal.done + array_namespace(goal.done).astype(there, goal.done.dtype))

    def reward(self, before: SpatialState, after: SpatialState, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step; see `Task.reward`."""
        xp, w = array_namespace(after.x), self.reward_weights
        old, new = self.errors(before, goal), self.errors(after, goal)
        reward = (
            w.progress * (old.position - new.position)
            + w.reached * xp.astype(ended.done > goal.done, after.x.dtype)
            - w.spin * length(after.rate)
        )
        if not self.turns:
            return reward
        near = xp.exp(-new.position / 0.5 - new.attitude / 0.5)
        return reward + w.turn * (old.attitude - new.attitude) + w.joint * near

    def errors(self, state: SpatialState, goal: Goal) -> Errors:
        """Distance from the current target, and angle to its attitude where that counts."""
        return place_errors(state, goal.current, attitude=self.turns)


@dataclass(frozen=True, kw_only=True)
class GoThroughPositions3d(SpaceWaypointTask):
    """Pass through random positions in space in their order."""

    kind: Literal["go_through_positions_3d"]


@dataclass(frozen=True, kw_only=True)
class GoThroughPoses3d(SpaceWaypointTask):
    """Pass through random poses in space in their order: place and attitude are right at the same time."""

    kind: Literal["go_through_poses_3d"]
    turns: ClassVar[bool] = True
