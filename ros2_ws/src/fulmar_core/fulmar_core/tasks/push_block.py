"""Push a block to its place, and leave it there."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from fulmar_core.dynamics.contact import Block, outline_of
from fulmar_core.dynamics.things import Thing
from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.planar import PlanarState, at_rest, to_body
from fulmar_core.states.rotation import Array
from fulmar_core.tasks.goal import Goal, no_obstacles, offset_to
from fulmar_core.tasks.task import FileTask
from fulmar_core.tasks.terms import MOTION_TERMS, Errors, motion_terms
from fulmar_core.tasks.waypoint_tasks import toward

Range = tuple[float, float]
BLOCK = "block"  # name of the thing
APART = 0.05  # least gap between robot and block at the start [m]
ROOM = 0.5  # span of starts for robots too large for the usual one [m]


@dataclass(frozen=True)
class PushReward:
    """Weights of the reward, per control step; d is from the block to its place, b from the robot to the block."""

    block: float  # times exp(-d / 0.25 m): RoboRAN tasks_cfg/push_block_cfg.py
    block_far: float  # times exp(-d / 2 m): leads in from metres away
    home: float  # for each step that the block is in its place
    push: float  # times metres the block comes nearer to its place
    robot: float  # times exp(-b / 0.25 m): RoboRAN, same file
    approach: float  # times metres the robot comes nearer to the block
    behind: float  # times how much more it stands behind the block, seen from its place: from -1 to 1
    spin: float  # cost of the turn rate [per rad/s]


@dataclass(frozen=True)
class PushBlock(FileTask[PlanarState]):
    """Push a block to a place; that arrives on `goal_point`, where the block is on `block/pose`."""

    kind: Literal["push_block"]
    block: Block
    block_distance: Range  # of the block from its place in evaluation [m]
    training_block_distance: Range  # same in training [m]
    start_distance: Range  # of the robot from the block; farther off where it would touch it [m]
    goal_area: float  # side of the square that places are drawn from [m]
    fine_distance: float  # where the magnified way of the block saturates [m]
    reward_weights: PushReward

    goal_topic: ClassVar[str] = "goal_point"
    observation_names: ClassVar[tuple[str, ...]] = (
        "block_direction_x_in_body",
        "block_direction_y_in_body",
        "block_distance",
        "place_direction_x_in_body",
        "place_direction_y_in_body",
        "block_to_place_distance",
        *MOTION_TERMS,
        "fine_block_to_place_x_in_body",
        "fine_block_to_place_y_in_body",
        "behind_block",
        "beside_block",
    )

    def __post_init__(self) -> None:
        for low, high in (self.block_distance, self.training_block_distance, self.start_distance):
            if not 0.0 <= low <= high:
                raise ValueError(
                    f"distances must be [low, high] with 0 <= low <= high, found [{low}, {high}]."
                )

    @functools.cached_property
    def things(self) -> tuple[Thing, ...]:
        """The block."""
        return (Thing(BLOCK, self.block),)

    def farthest_start(self, *, training: bool) -> tuple[str, float]:
        """As in `Task`: the block's and the robot's distances add up."""
        name = "training_block_distance" if training else "block_distance"
        return f"{name}' + 'start_distance", getattr(self, name)[1] + self.start_distance[1]

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[PlanarState, Goal]:
        """Draw where robot and block start, and where the block belongs; see `Task.draw`."""
        half, n = 0.5 * self.goal_area, draws.worlds
        place = np.asarray(draws.uniform(-half, half, 2))
        angles = np.asarray(draws.uniform(-math.pi, math.pi, 3))
        distance = np.asarray(
            draws.uniform(*(self.training_block_distance if training else self.block_distance))
        )
        block = place + distance[:, None] * np.stack((np.cos(angles[:, 0]), np.sin(angles[:, 0])), axis=-1)
        least = outline_of(robot).extent + self.block.radius + APART
        low = max(self.start_distance[0], least)
        away = np.asarray(draws.uniform(low, max(self.start_distance[1], low + ROOM)))
        start = at_rest(
            block[:, 0] + away * np.cos(angles[:, 1]), block[:, 1] + away * np.sin(angles[:, 1]), angles[:, 2]
        )
        targets = np.concatenate((place, np.zeros((n, 1))), axis=-1)[:, None, :]
        pose = np.concatenate((block, np.zeros((n, 1))), axis=-1)
        return start, Goal(targets, np.zeros(n), no_obstacles(n), {BLOCK: pose})

    def observe(self, state: PlanarState, goal: Goal) -> tuple[Array, ...]:
        """What every controller of this task sees; see `Task.observe`."""
        block_x, block_y, block_distance = toward(state, goal.things[BLOCK])
        place_x, place_y, _ = toward(state, goal.current)
        dx, dy, distance = self._way(goal)
        divisor = clip(distance, self.fine_distance, None)
        fine_x, fine_y = to_body(state.yaw, dx / divisor, dy / divisor)
        return (
            block_x,
            block_y,
            block_distance,
            place_x,
            place_y,
            distance,
            *motion_terms(state),
            fine_x,
            fine_y,
            block_x * fine_x + block_y * fine_y,
            block_x * fine_y - block_y * fine_x,
        )

    def reward(self, before: PlanarState, after: PlanarState, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step: how the robot moved, and how the block did; see `Task.reward`."""
        xp = array_namespace(after.x)
        w = self.reward_weights
        far, was_behind = self._stance(before, goal)
        near, is_behind = self._stance(after, goal)
        old, d = self._way(goal)[2], self._way(ended)[2]
        return (
            w.robot * xp.exp(-near / 0.25)
            + w.approach * (far - near)
            + w.behind * (is_behind - was_behind)
            - w.spin * xp.abs(after.yaw_rate)
            + w.block * xp.exp(-d / 0.25)
            + w.block_far * xp.exp(-d / 2.0)
            + w.home * xp.astype(d <= self.tolerance.position, d.dtype)
            + w.push * (old - d)
        )

    def errors(self, state: PlanarState, goal: Goal) -> Errors:
        """Distance of the block from its place."""
        return Errors(position=self._way(goal)[2])

    def distance_from_goal(self, state: PlanarState, goal: Goal) -> Array:
        """Of robot or block from the block's place, whichever is farther; see `fulmar_core.safety.geofence` [m]."""
        xp, target = array_namespace(state.x), goal.current
        robot = xp.hypot(target[..., 0] - state.x, target[..., 1] - state.y)
        return xp.maximum(robot, self._way(goal)[2])

    def _way(self, goal: Goal) -> tuple[Array, Array, Array]:
        """From the block to its place in the world, and how far that is [m]."""
        target, block = goal.current, goal.things[BLOCK]
        dx, dy = target[..., 0] - block[..., 0], target[..., 1] - block[..., 1]
        return dx, dy, array_namespace(dx).sqrt(dx * dx + dy * dy)

    def _stance(self, state: PlanarState, goal: Goal) -> tuple[Array, Array]:
        """Distance of the robot from the block [m], and 1 behind it, -1 in front of it, 0 where it is at its place."""
        xp = array_namespace(state.x)
        bx, by = offset_to(state, goal.things[BLOCK])
        b = xp.sqrt(bx * bx + by * by)
        dx, dy, d = self._way(goal)
        size = clip(b, 1e-3, None) * clip(d, self.fine_distance, None)
        return b, (bx * dx + by * dy) / size
