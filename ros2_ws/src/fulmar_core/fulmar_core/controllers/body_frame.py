"""Inputs of a control step in the body's own frame: what classical laws compute with."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.robots.robot import Robot
from fulmar_core.states.planar import to_body, wrapped
from fulmar_core.tasks import Task
from fulmar_core.tasks.go_to_position_with_obstacles import GoToPositionWithObstacles
from fulmar_core.tasks.goal import offset_to
from fulmar_core.tasks.obstacles import FAR, SIGHT
from fulmar_core.tasks.shortest_paths import TOUCHING

Vector = tuple[np.ndarray, np.ndarray]  # ahead and to the left, shapes (n,) [m]
Twist = tuple[np.ndarray, np.ndarray, np.ndarray]  # ahead, to the left [m/s], turn rate [rad/s], shapes (n,)


@dataclass(frozen=True)
class BodyState:
    """One moment of n robots, each in its body's own frame; shapes (n,) unless said."""

    goal: Vector  # way to the current target; zeros where velocities are the goal
    turn: np.ndarray  # wanted heading minus heading, 0 where a task has none [rad]
    motion: Twist
    # Force and torque from outside, zeros where nothing is estimated, shape (n, 3) [N, N, N·m].
    push: np.ndarray
    alive: (
        np.ndarray | None
    )  # 0 for a valve that should stay closed, else 1, shape (n, m); None: not estimated


class BodyFrame:
    """Turns inputs of a robot at a task into its body's frame.

    Attributes:
        heads: The current target has a heading.
        passes: Another target follows the current one.
        tracks: The target is a velocity.
        crosses_obstacles: Obstacles stand about.
    """

    def __init__(self, robot: Robot, task: Task) -> None:
        self.tracks, self.passes = task.goal_topic == "goal_velocity", task.goal_topic == "goal_path"
        self.heads = task.goal_topic == "goal_pose" or bool(getattr(task, "heads", False))
        self._around = task if isinstance(task, GoToPositionWithObstacles) else None
        self._clearance = self._around.obstacles.clearance(robot) if self._around else 0.0

    @property
    def crosses_obstacles(self) -> bool:
        """Obstacles stand about."""
        return self._around is not None

    def body_state(self, inputs: Inputs) -> BodyState:
        """Everything but obstacles and further targets; of the estimated motion, where there is an estimate."""
        estimate = inputs.estimates
        if estimate is not None:
            inputs = replace(inputs, state=estimate.state)
        motion = self.motion(inputs)
        zero = np.zeros_like(motion[2])
        return BodyState(
            (zero, zero) if self.tracks else self.goal(inputs),
            self.turn(inputs) if self.heads else zero,
            motion,
            np.zeros((*zero.shape, 3)) if estimate is None else estimate.push,
            None if estimate is None else estimate.alive,
        )

    def goal(self, inputs: Inputs) -> Vector:
        """Way to the current target; around obstacles, its beginning, as long as all of it."""
        if self._around is not None:
            return self._around.way_in_body(inputs.state, inputs.goal)
        return self._to(inputs, 0)

    def next_leg(self, inputs: Inputs) -> Vector:
        """Way from the current target to the one after it."""
        (x, y), (next_x, next_y) = self._to(inputs, 0), self._to(inputs, 1)
        return next_x - x, next_y - y

    def turn(self, inputs: Inputs) -> np.ndarray:
        """Wanted heading minus heading, in [-pi, pi], shape (n,) [rad]."""
        return np.asarray(wrapped(inputs.goal.current[..., 2] - inputs.state.yaw))

    def motion(self, inputs: Inputs) -> Twist:
        """Velocity of the body."""
        u, v = inputs.state.velocity_in_body
        return u, v, inputs.state.yaw_rate

    def wanted_motion(self, inputs: Inputs) -> Twist:
        """Velocity that is the goal."""
        u, v, r = np.moveaxis(inputs.goal.current, -1, 0)
        return u, v, r

    def obstacles(self, inputs: Inputs) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Obstacles in sight: centres, and how wide they are where ways lead around them.

        Returns:
            Three arrays of shape (n, k) [m]; those that are out of sight, or not there, lie far behind the robot.
        """
        state, discs = inputs.state, inputs.goal.obstacles
        x, y = to_body(
            state.yaw[..., None], discs[..., 0] - state.x[..., None], discs[..., 1] - state.y[..., None]
        )
        away = (np.hypot(x, y) > SIGHT - 1e-3) | (discs[..., 2] <= 0.0)
        wide = TOUCHING * (discs[..., 2] + self._clearance)
        return np.where(away, -FAR, x), np.where(away, 0.0, y), wide

    def _to(self, inputs: Inputs, further: int) -> Vector:
        """Way to the current target, or to one after it."""
        return to_body(inputs.state.yaw, *offset_to(inputs.state, inputs.goal.ahead(further)))
