"""Inputs of a control step of bodies in space, in the body's own frame."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.states.attitude import Quaternion, Vector, conjugate, minus, product, turn, turn_back
from fulmar_core.states.spatial import SpatialState, position_of, quat_of
from fulmar_core.tasks import Task


@dataclass(frozen=True)
class SpaceMotion:
    """One moment of n bodies, each in its own frame; shapes (n, 3) unless said."""

    way: np.ndarray  # to the current target; zeros where velocities are the goal [m]
    to_goal: Quaternion  # rotation to the wanted attitude, shapes (n,); none where no attitude is wanted
    velocity: np.ndarray  # less that of the goal: the wanted one, or of a target that moves [m/s]
    rate: np.ndarray  # same of the turn rate [rad/s]
    moving: np.ndarray  # the velocity itself [m/s]
    turning: np.ndarray  # the turn rate itself [rad/s]
    alive: (
        np.ndarray | None
    )  # 0 for an actuator that should stay at rest, else 1, shape (n, m); None: not estimated


class SpaceFrame:
    """Turns inputs of a body at a task in space into its own frame.

    Attributes:
        heads: The current target has an attitude.
        passes: Another target follows the current one.
        tracks: The target is a velocity.
    """

    def __init__(self, task: Task) -> None:
        self.task = task
        self.tracks = task.goal_topic == "goal_velocity"
        self.passes = task.goal_topic == "goal_path" and not task.moves
        self.heads = task.goal_topic == "goal_pose" or task.moves or bool(getattr(task, "turns", False))

    def motion(self, inputs: Inputs) -> SpaceMotion:
        """Errors and motion; of the estimated state, where there is an estimate."""
        estimate, state = inputs.estimates, _state(inputs)
        target = self.task.target_of(inputs.goal)
        alive = None if estimate is None else estimate.alive
        velocity, rate = _rows(state.velocity_in_body), _rows(state.rate)
        none = np.zeros_like(state.qw)
        to_goal = none, none, none, none + 1.0
        if self.heads:
            to_goal = product(conjugate(state.quat), quat_of(target))
        if self.tracks:
            missing = velocity - target[..., :3], rate - target[..., 3:]
            return SpaceMotion(np.zeros_like(velocity), to_goal, *missing, velocity, rate, alive)
        way = _rows(turn_back(state.quat, minus(position_of(target), state.position)))
        return SpaceMotion(way, to_goal, velocity, rate, velocity, rate, alive)

    def less_target(self, now: SpaceMotion, inputs: Inputs, target: np.ndarray) -> SpaceMotion:
        """The same motion, less that of the target.

        Args:
            now: As in `motion`.
            inputs: It came from them.
            target: Velocity in the world [m/s], and turn rate about the target's own axes, of none where no attitude is
                wanted [rad/s], shape (n, 6).
        """
        along, about = self.of_target(now, inputs, target)
        found = replace(now, velocity=now.velocity - along)
        return replace(found, rate=now.rate - about) if self.heads else found

    def of_target(
        self, now: SpaceMotion, inputs: Inputs, target: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Two vectors of the target in the body's own frame, the second 0 where no attitude is wanted.

        Args:
            now: As in `motion`.
            inputs: It came from them.
            target: One in the world and one about the target's own axes, shape (n, 6).
        """
        along = _rows(turn_back(_state(inputs).quat, tuple(target[:, :3].T)))
        return along, _rows(turn(now.to_goal, tuple(target[:, 3:].T))) * float(self.heads)

    def next_leg(self, inputs: Inputs) -> np.ndarray:
        """Way from the current target to the one after it, in the body's frame, shape (n, 3) [m]."""
        here, there = inputs.goal.current, inputs.goal.ahead(1)
        return _rows(turn_back(_state(inputs).quat, minus(position_of(there), position_of(here))))


def _state(inputs: Inputs) -> SpatialState:
    """The state to act on."""
    source: Any = inputs if inputs.estimates is None else inputs.estimates
    state: SpatialState = source.state
    return state


def _rows(vector: Vector) -> np.ndarray:
    return np.stack(vector, axis=-1)
