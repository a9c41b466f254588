"""Tasks that visit waypoints one after another, as many as time allows."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal, Self

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.planar import PlanarState, at_rest, to_body, wrapped
from fulmar_core.states.rotation import Array
from fulmar_core.tasks.goal import Goal, no_obstacles
from fulmar_core.tasks.task import FileTask
from fulmar_core.tasks.terms import (
    MOTION_TERMS,
    Errors,
    goal_terms,
    heading_terms,
    motion_terms,
    pose_errors,
)
from fulmar_core.tasks.waypoint_courses import RaceTrack, WaypointCourse, headings_along

PLACE_TERMS = ("direction_x_in_body", "direction_y_in_body", "distance")
TURN_TERMS = ("cos_heading_error", "sin_heading_error")
IN_ORDER = ("goal", "next_goal", "goal_after_next")
_SURE = 3.0  # standard deviations of the positioning that a reach stays within the tolerance


def path_terms(seen: int, *, heading: bool) -> tuple[str, ...]:
    """Names of the observation terms of 1 to 3 targets, from the current one on, with or without their headings."""
    each = (*PLACE_TERMS, *TURN_TERMS) if heading else PLACE_TERMS
    return (*MOTION_TERMS, *(f"{target}_{name}" for target in IN_ORDER[:seen] for name in each))


@dataclass(frozen=True)
class WaypointReward:
    """Weights of the reward, per control step."""

    progress: float  # times metres come nearer to the current waypoint
    reached: float  # for each waypoint reached
    bearing: float  # times exp(-|bearing of the waypoint| / 0.25 rad): RoboRAN tasks_cfg/go_through_positions_cfg.py
    spin: float  # cost of the turn rate [per rad/s]

    def of(self, progress: Array, reached: Array, bearing: Array, after: PlanarState) -> Array:
        """Reward of having come nearer [m], of targets reached (0 or 1) and of where the target is [rad]."""
        xp = array_namespace(progress)
        return (
            self.progress * progress
            + self.reached * xp.astype(reached, progress.dtype)
            + self.bearing * xp.exp(-xp.abs(bearing) / 0.25)
            - self.spin * xp.abs(after.yaw_rate)
        )


@dataclass(frozen=True, kw_only=True)
class WaypointTask(FileTask[PlanarState]):
    """Pass targets in their order; they arrive on `goal_path`. Each kind says where its targets lie."""

    start_distance: tuple[float, float]  # from the first target [m]
    start_cone_deg: float = 180.0  # from straight behind the first target; 180: on any side of it [deg]
    reach: float  # radius within which a target counts as reached; `fitted` may widen it [m]
    required: int = field()  # targets that make an episode a success; a file has to say it
    reward_weights: WaypointReward

    goal_topic: ClassVar[str] = "goal_path"
    heads: ClassVar[bool] = False  # whether the targets' headings count
    seen: ClassVar[int] = 2  # targets that a controller sees
    observation_names: ClassVar[tuple[str, ...]] = path_terms(2, heading=False)

    def __post_init__(self) -> None:
        if not 0.0 < self.reach <= self.tolerance.position:
            raise ValueError("'reach' must be greater than 0 and at most the tolerance of the position.")
        if not 0.0 <= self.start_cone_deg <= 180.0:
            raise ValueError("'start_cone_deg' must lie in [0, 180].")

    def fitted(self, robot: Robot) -> Self:
        """The task with a radius from `reach` up to the tolerance, by how well the robot's odometry knows its place."""
        reach = self.tolerance.position - _SURE * robot.sensors.odometry.position.std
        return replace(self, reach=max(self.reach, reach))

    def farthest_start(self, *, training: bool) -> tuple[str, float]:
        """See `Task.farthest_start`."""
        return "start_distance", self.start_distance[1]

    @abstractmethod
    def places(self, draws: Draws) -> np.ndarray:
        """Draw where the targets are, shape (worlds, k, 2) [m]."""

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[PlanarState, Goal]:
        """Draw a start at rest and closed waypoints."""
        places = self.places(draws)
        heading = headings_along(places)
        distance = np.asarray(draws.uniform(*self.start_distance))
        cone = math.radians(self.start_cone_deg)
        bearing = heading[:, 0] + math.pi + np.asarray(draws.uniform(-cone, cone))
        yaw = np.asarray(draws.uniform(-math.pi, math.pi))
        x, y = places[:, 0, 0] + distance * np.cos(bearing), places[:, 0, 1] + distance * np.sin(bearing)
        targets = np.concatenate((places, heading[..., None]), axis=-1)
        n = draws.worlds
        return at_rest(x, y, yaw), Goal(targets, np.zeros(n), no_obstacles(n))

    def observe(self, state: PlanarState, goal: Goal) -> tuple[Array, ...]:
        """What every controller of this task sees; see `Task.observe`."""
        terms: tuple[Array, ...] = motion_terms(state)
        for further in range(self.seen):
            target = goal.ahead(further)
            terms += toward(state, target)
            if self.heads:
                terms += heading_terms(state, target)
        return terms

    def advance(self, goal: Goal, state: PlanarState, time_s: Array) -> Goal:
        """A target that is passed is done."""
        return self._after(goal, state, self.reached(goal, state, self.reach))

    def counted(self, goal: Goal, state: PlanarState, time_s: Array) -> Goal:
        """The goal with one more target done where the current one is within the tolerance; see `Task.counted`."""
        return self._after(goal, state, self.reached(goal, state, self.tolerance.position, strict=False))

    def reached(self, goal: Goal, state: PlanarState, radius: float, *, strict: bool = True) -> Array:
        """Whether the current target is passed.

        Args:
            goal: Before this step.
            state: After it, shapes (...,).
            radius: How near counts [m].
            strict: Check the heading, where it counts, as a controller does and not as evaluation does.

        Returns:
            Truth values, shape (...,).
        """
        return self.errors(state, goal).position < radius

    def _after(self, goal: Goal, state: PlanarState, reached: Array) -> Goal:
        done = goal.done + array_namespace(goal.done).astype(reached, goal.done.dtype)
        return replace(goal, done=done)

    def reward(self, before: PlanarState, after: PlanarState, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step; see `Task.reward`."""
        old, new = self.errors(before, goal).position, self.errors(after, goal).position
        return self.reward_weights.of(
            old - new, newly_done(goal, ended), bearing_of(after, goal.current), after
        )

    def errors(self, state: PlanarState, goal: Goal) -> Errors:
        """Distance from the current target, and heading error where that counts."""
        return pose_errors(state, goal.current, heading=self.heads)


def newly_done(goal: Goal, ended: Goal) -> Array:
    """Whether a target was done in a control step, shape (...,)."""
    return ended.done > goal.done


def toward(state: PlanarState, target: Array) -> tuple[Array, Array, Array]:
    """Direction of a target in the body's frame, and its distance [m], `PLACE_TERMS`."""
    xp = array_namespace(state.x)
    x, y = goal_terms(state, target)
    distance = xp.sqrt(x * x + y * y)
    safe = clip(distance, 1e-3, None)
    return x / safe, y / safe, distance


def bearing_of(state: PlanarState, target: Array) -> Array:
    """Angle from the body's x axis to a target, in [-pi, pi] [rad]."""
    x, y = goal_terms(state, target)
    return wrapped(array_namespace(x).atan2(y, x))


@dataclass(frozen=True)
class PoseWaypointReward(WaypointReward):
    """Weights of the reward, per control step."""

    heading: float  # times exp(-d / 0.5 m - |e| / 0.25 rad): look the right way when near
    turn: float  # times radians come nearer, the more the nearer the waypoint: exp(-d / 1 m)


@dataclass(frozen=True, kw_only=True)
class PoseWaypointTask(WaypointTask):
    """Pass through poses: a target counts where place and heading are right at the same time."""

    reach_heading_deg: float  # a heading counts as right for a controller, within the tolerance [deg]
    reward_weights: PoseWaypointReward

    heads: ClassVar[bool] = True
    observation_names: ClassVar[tuple[str, ...]] = path_terms(2, heading=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 < self.reach_heading_deg <= self.tolerance.heading_deg:
            raise ValueError(
                "'reach_heading_deg' must be greater than 0 and at most the tolerance of the heading."
            )

    def reached(self, goal: Goal, state: PlanarState, radius: float, *, strict: bool = True) -> Array:
        """Whether the current target is passed with the right heading; see `WaypointTask.reached`."""
        limit = math.radians(self.reach_heading_deg if strict else self.tolerance.heading_deg)
        errors = self.errors(state, goal)
        return (errors.position < radius) & (array_namespace(state.x).abs(errors.heading) < limit)

    def reward(self, before: PlanarState, after: PlanarState, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step; see `Task.reward`."""
        xp = array_namespace(after.x)
        w, old, new = self.reward_weights, self.errors(before, goal), self.errors(after, goal)
        reached = newly_done(goal, ended)
        e, d = xp.abs(new.heading), new.position
        target = goal.current
        progress = _way_to(before, target, old.position) - _way_to(after, target, d)
        plain = w.of(progress, reached, bearing_of(after, target), after)
        turned = xp.exp(-d) * (xp.abs(old.heading) - e)
        return plain + w.heading * xp.exp(-d / 0.5 - e / 0.25) + w.turn * turned


def _way_to(state: PlanarState, target: Array, distance: Array) -> Array:
    """How far it is to a pose by way of a point behind it, half as far off as the robot [m]."""
    xp = array_namespace(state.x)
    along, across = to_body(target[..., 2], target[..., 0] - state.x, target[..., 1] - state.y)
    along = along - 0.5 * distance
    return 0.5 * distance + xp.sqrt(along * along + across * across)


@dataclass(frozen=True, kw_only=True)
class _OnCourse:
    """Targets of a random course."""

    course: WaypointCourse

    def places(self, draws: Draws) -> np.ndarray:
        """Draw where the targets are, shape (worlds, k, 2) [m]."""
        return self.course.draw(draws)


@dataclass(frozen=True, kw_only=True)
class _OnTrack:
    """Targets at the corners of a race track."""

    track: RaceTrack

    def places(self, draws: Draws) -> np.ndarray:
        """Draw where the targets are, shape (worlds, k, 2) [m]."""
        return self.track.draw(draws)


@dataclass(frozen=True, kw_only=True)
class GoThroughPositions(_OnCourse, WaypointTask):
    """Pass through random positions in their order.

    Three of them are seen, one more than in RoboRAN: where a boat leaves a waypoint to depends on the next two.
    """

    kind: Literal["go_through_positions"]
    seen: ClassVar[int] = 3
    observation_names: ClassVar[tuple[str, ...]] = path_terms(3, heading=False)


@dataclass(frozen=True, kw_only=True)
class GoThroughPoses(_OnCourse, PoseWaypointTask):
    """Pass through random poses in their order; each looks from the one before to the one after."""

    kind: Literal["go_through_poses"]


@dataclass(frozen=True, kw_only=True)
class RaceWaypoints(_OnTrack, WaypointTask):
    """Pass through the corners of a race track in their order."""

    kind: Literal["race_waypoints"]


@dataclass(frozen=True, kw_only=True)
class RaceWayposes(_OnTrack, PoseWaypointTask):
    """Pass through the corners of a race track in their order, looking along it."""

    kind: Literal["race_wayposes"]
