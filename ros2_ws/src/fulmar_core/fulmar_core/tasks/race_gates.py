"""Drive through the gates of a race track, one after another, as many as time allows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, Self

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.planar import PlanarState, to_body
from fulmar_core.states.rotation import Array
from fulmar_core.tasks.goal import Goal
from fulmar_core.tasks.terms import Errors, pose_errors
from fulmar_core.tasks.waypoint_courses import RaceTrack
from fulmar_core.tasks.waypoint_tasks import WaypointReward, WaypointTask, bearing_of, newly_done, path_terms

LAST = "robot_a_step_ago"  # pose that a goal keeps
JUMP = 1.0  # who moves farther than this in one step was carried, or the goal is new [m]
ENTRY = 1.0  # where to turn who is behind a gate: so far in front of it [m]


@dataclass(frozen=True)
class GateReward(WaypointReward):
    """Weights of the reward, per control step; `reached` is for each gate passed."""

    reverse: float  # cost of passing the current gate from behind


@dataclass(frozen=True, kw_only=True)
class RaceGates(WaypointTask):
    """Pass between the posts of gates, each in the direction of the track.

    A gate is a pose: its middle, and the direction that counts. `reach` and the tolerance are half its width, for
    controllers and for evaluation. It is passed when the way of one step crosses the line between its posts.
    """

    kind: Literal["race_gates"]
    track: RaceTrack
    reward_weights: GateReward

    heads: ClassVar[bool] = True
    seen: ClassVar[int] = 3
    observation_names: ClassVar[tuple[str, ...]] = path_terms(3, heading=True)

    def fitted(self, robot: Robot) -> Self:
        """As it is: its reach keeps robots off posts."""
        return self

    def places(self, draws: Draws) -> np.ndarray:
        """Draw where the targets are, shape (worlds, k, 2) [m]."""
        return self.track.draw(draws)

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[PlanarState, Goal]:
        """Draw a start at rest and a closed track."""
        start, goal = super().draw(draws, robot, training=training)
        return start, self.begun(goal, start)

    def begun(self, goal: Goal, state: PlanarState) -> Goal:
        """The goal with the pose from which the next step leads; see `Task`."""
        return goal.among({LAST: array_namespace(state.x).stack((state.x, state.y, state.yaw), axis=-1)})

    def reached(self, goal: Goal, state: PlanarState, radius: float, *, strict: bool = True) -> Array:
        """Whether the current gate is passed in its direction; see `WaypointTask.reached`."""
        last = goal.things[LAST]
        return crossings(last[..., 0], last[..., 1], state, goal.current, radius)[0]

    def _after(self, goal: Goal, state: PlanarState, reached: Array) -> Goal:
        return self.begun(super()._after(goal, state, reached), state)

    def reward(self, before: PlanarState, after: PlanarState, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step; see `Task.reward`."""
        xp = array_namespace(after.x)
        gate = goal.current
        forward = newly_done(goal, ended)
        backward = crossings(before.x, before.y, after, gate, self.reach)[1]
        left = _way_to(after, gate)
        progress = _way_to(before, gate) - xp.where(forward, xp.zeros_like(left), left)
        plain = self.reward_weights.of(progress, forward, bearing_of(after, gate), after)
        return plain - self.reward_weights.reverse * xp.astype(backward, plain.dtype)

    def errors(self, state: PlanarState, goal: Goal) -> Errors:
        """Distance from the middle of the current gate."""
        return pose_errors(state, goal.current, heading=False)


def crossings(x: Array, y: Array, after: PlanarState, gate: Array, half_width: float) -> tuple[Array, Array]:
    """Whether a step led between the posts of a gate.

    Args:
        x: Where the step began, shape (...,) [m].
        y: Same.
        after: Where it ended.
        gate: Middle and direction, shape (..., 3) [m, m, rad].
        half_width: From the middle to a post [m].

    Returns:
        Truth values, shapes (...,): in the gate's direction, and against it.
    """
    xp = array_namespace(after.x)
    old, off = to_body(gate[..., 2], x - gate[..., 0], y - gate[..., 1])
    new, end = to_body(gate[..., 2], after.x - gate[..., 0], after.y - gate[..., 1])
    way = new - old
    share = -old / xp.where(way == 0.0, xp.ones_like(way), way)
    between = (xp.abs(off + share * (end - off)) < half_width) & (way * way + (end - off) ** 2 < JUMP * JUMP)
    return between & (old < 0.0) & (new >= 0.0), between & (old >= 0.0) & (new < 0.0)


def _way_to(state: PlanarState, gate: Array) -> Array:
    """How far it is to the middle of a gate; from behind it, around its post and by way of a point in front [m]."""
    xp = array_namespace(state.x)
    along, across = to_body(gate[..., 2], state.x - gate[..., 0], state.y - gate[..., 1])
    direct, entry = xp.sqrt(along * along + across * across), along + ENTRY
    return xp.where(along < 0.0, direct, ENTRY + xp.sqrt(entry * entry + across * across))
