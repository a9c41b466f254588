"""What tasks share whose targets are passed in a certain direction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from fulmar_core.arrays import array_namespace
from fulmar_core.goal import Goal
from fulmar_core.planar import PlanarState, to_body
from fulmar_core.rotation import Array
from fulmar_core.tasks.waypoint_tasks import PassingTask, WaypointReward, bearing_of, newly_done, path_terms


@dataclass(frozen=True)
class PoseWaypointReward(WaypointReward):
    """Weights of the reward, per control step."""

    heading: float  # times exp(-d / 0.5 m - |e| / 0.25 rad): look the right way when near
    turn: float  # times radians come nearer, the more the nearer the waypoint: exp(-d / 1 m)


@dataclass(frozen=True, kw_only=True)
class PosePassingTask(PassingTask):
    """Pass through poses: a target counts where place and heading are right at the same time."""

    reach_heading_deg: (
        float  # a controller takes a heading for right within this, less than the tolerance [deg]
    )
    reward_weights: PoseWaypointReward

    heads: ClassVar[bool] = True
    observation_names: ClassVar[tuple[str, ...]] = path_terms(2, heading=True)

    def __post_init__(self) -> None:
        """Refuse a reach that judges would not count."""
        super().__post_init__()
        if not 0.0 < self.reach_heading_deg <= self.tolerance.heading_deg:
            raise ValueError(
                "'reach_heading_deg' must be greater than 0 and at most the tolerance of the heading."
            )

    def reached(self, goal: Goal, state: PlanarState, radius: float, *, strict: bool = True) -> Array:
        """Whether the current target is passed with the right heading; see `PassingTask.reached`."""
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
