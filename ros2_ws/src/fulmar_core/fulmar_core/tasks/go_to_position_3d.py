"""Reach a position in space, whatever the attitude, and stay there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from fulmar_core.robots.robot import Robot
from fulmar_core.states.attitude import length
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks.go_to_position import PositionReward
from fulmar_core.tasks.goal import Goal, goals_at
from fulmar_core.tasks.space_terms import (
    FINE_TERMS,
    MOTION_TERMS,
    POSITION_TERMS,
    SpaceStart,
    fine_terms,
    goal_terms,
    motion_terms,
    place_errors,
)
from fulmar_core.tasks.task import FileTask
from fulmar_core.tasks.terms import Errors


@dataclass(frozen=True)
class GoToPosition3d(FileTask[SpatialState]):
    """Go to a position in space; the goal arrives on `goal_point`."""

    kind: Literal["go_to_position_3d"]
    start: SpaceStart
    fine_distance: float  # where the magnified position saturates [m]
    reward_weights: PositionReward

    goal_topic: ClassVar[str] = "goal_point"
    state_type = SpatialState
    observation_names: ClassVar[tuple[str, ...]] = (*POSITION_TERMS, *FINE_TERMS, *MOTION_TERMS)

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[SpatialState, Goal]:
        """Draw starts and goals; see `Task.draw`."""
        start, target = self.start.draw_in_space(draws, training=training, tilt_deg=robot.kind.tilt_deg)
        return start, goals_at(target)

    def observe(self, state: SpatialState, goal: Goal) -> tuple[Array, ...]:
        """What every controller of this task sees; see `Task.observe`."""
        way = goal_terms(state, goal.current)
        return (*way, *fine_terms(way, saturation=self.fine_distance), *motion_terms(state))

    def reward(self, before: SpatialState, after: SpatialState, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step; see `Task.reward`."""
        old, d = self.errors(before, goal).position, self.errors(after, goal).position
        return self.reward_weights.of(old, d, length(after.rate))

    def errors(self, state: SpatialState, goal: Goal) -> Errors:
        """Distance from the goal."""
        return place_errors(state, goal.current, attitude=False)
