"""Come to a port of a thing in space and stay before it, seen by the robot's own camera alone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.attitude import exponential, product, turn
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks.goal import Goal, goals_at
from fulmar_core.tasks.space_terms import MOTION_TERMS, motion_terms, place_errors
from fulmar_core.tasks.task import FileTask
from fulmar_core.tasks.terms import Errors, weighted_sum
from fulmar_core.worlds.structures import KeepOut

Range = tuple[float, float]
Pose = tuple[float, float, float, float, float, float, float]


@dataclass(frozen=True)
class DockStart:
    """Where episodes begin, seen from the berth: behind it along its x, the axis of the approach."""

    behind: Range  # [m]
    aside: float  # at most, along its y and its z each [m]
    tilt_deg: float  # at most, about each of its axes

    def __post_init__(self) -> None:
        low, high = self.behind
        if not 0.0 <= low <= high or min(self.aside, self.tilt_deg) < 0.0:
            raise ValueError(
                "'behind' must be [low, high] with 0 <= low <= high, 'aside' and 'tilt_deg' not negative."
            )


@dataclass(frozen=True)
class DockReward:
    """Weights of the reward, per control step; d is the distance, e the angle to the berth's attitude."""

    far: float  # times exp(-d / 2 m): leads in from metres away
    joint: float  # times exp(-d / 0.1 m - e / 0.15 rad): asks for both at once
    approach: float  # times metres come nearer


@dataclass(frozen=True, kw_only=True)
class Dock(FileTask[SpatialState]):
    """Come to a berth before a port and stay there; where that is, a policy has to see.

    Laws and the rule of success have the berth as the goal, which arrives on `goal_pose`; the observation has nothing
    of it.
    """

    kind: Literal["dock"]
    berth: Pose  # of the docked body in the frame of `thing`: x, y, z [m], quaternion x, y, z, w; x points at the port
    start: DockStart
    reward_weights: DockReward

    goal_topic: ClassVar[str] = "goal_pose"
    keeps_thing: bool = True
    state_type = SpatialState
    observation_names: ClassVar[tuple[str, ...]] = MOTION_TERMS

    def __post_init__(self) -> None:
        if not self.thing:
            raise ValueError("'thing' is missing: name what has the port.")
        if abs(math.hypot(*self.berth[3:]) - 1.0) > 1e-3:
            raise ValueError("'berth' must be x, y, z in metres and a unit quaternion x, y, z, w.")

    @property
    def keep_outs(self) -> tuple[KeepOut, ...]:
        """None: who docks enters the volume about its port."""
        return ()

    def goal_problem(self, places: Array) -> str:
        """How a goal is not the berth: it may lie within the thing, and no camera shows it; see `Task.goal_problem`."""
        if not len(places):
            return ""
        away = np.linalg.norm(np.asarray(places, dtype=float)[:, :3] - np.array(self.berth[:3]), axis=1)
        if not (away > self.tolerance.position).any():
            return ""
        berth = ", ".join(f"{axis} = {each:g} m" for axis, each in zip("xyz", self.berth[:3], strict=True))
        return f"the goal lies {away.max():.2f} m from the berth of '{self.name}', {berth}."

    def farthest_start(self, *, training: bool) -> tuple[str, float]:
        """See `Task.farthest_start`."""
        return "start.behind", math.hypot(self.start.behind[1], self.start.aside, self.start.aside)

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[SpatialState, Goal]:
        """Draw starts and goals; see `Task.draw`."""
        start, tilt = self.start, math.radians(self.start.tilt_deg)
        behind, aside = draws.uniform(*start.behind), draws.uniform(-start.aside, start.aside, 2)
        angles = draws.uniform(-tilt, tilt, 3)
        xp = array_namespace(behind)
        quat = tuple(xp.zeros_like(behind) + number for number in self.berth[3:])
        way = turn(quat, (-behind, aside[:, 0], aside[:, 1]))
        place = tuple(number + each for number, each in zip(self.berth[:3], way, strict=True))
        tilted = product(quat, exponential((angles[:, 0], angles[:, 1], angles[:, 2])))
        return SpatialState.at_rest(place, tilted), goals_at(np.tile(np.array(self.berth), (len(behind), 1)))

    def observe(self, state: SpatialState, goal: Goal) -> tuple[Array, ...]:
        """Its own motion, and nothing of the goal; see `Task.observe`."""
        return motion_terms(state)

    def reward(self, before: SpatialState, after: SpatialState, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step; see `Task.reward`."""
        old, new = self.errors(before, goal), self.errors(after, goal)
        xp, w, d = array_namespace(after.x), self.reward_weights, new.position
        return weighted_sum(
            (w.far, lambda: xp.exp(-d / 2.0)),
            (w.joint, lambda: xp.exp(-d / 0.1 - new.attitude / 0.15)),
            (w.approach, lambda: old.position - d),
            zero=xp.zeros_like(d),
        )

    def errors(self, state: SpatialState, goal: Goal) -> Errors:
        """Distance from the berth, and angle to its attitude."""
        return place_errors(state, goal.current, attitude=True)
