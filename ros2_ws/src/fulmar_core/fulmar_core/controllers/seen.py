"""An observation read back into the quantities that classical laws compute with."""

from __future__ import annotations

import re

import numpy as np

from fulmar_core.observation import Observer
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task
from fulmar_core.tasks.go_to_position_with_obstacles import GoToPositionWithObstacles
from fulmar_core.tasks.obstacles import FAR, SIGHT
from fulmar_core.tasks.terms import HEADING_TERMS
from fulmar_core.tasks.ways import TOUCHING

Vector = tuple[np.ndarray, np.ndarray]  # ahead and to the left, shapes (...,) [m]


class Reader:
    """Knows where each quantity stands in the observations of a robot at a task.

    Attributes:
        names: Terms of an observation, in order.
    """

    def __init__(self, robot: Robot, task: Task) -> None:
        """Look the terms up."""
        self.names = Observer(robot, task).names
        self._actuators = robot.actuators
        self._column = {name: i for i, name in enumerate(self.names)}
        pairs = (HEADING_TERMS, tuple(f"goal_{name}" for name in HEADING_TERMS))
        self._heading = next((pair for pair in pairs if pair[0] in self._column), ())
        self._wide = 0.0
        if isinstance(task, GoToPositionWithObstacles):
            self._wide = TOUCHING * (task.obstacles.radius + task.obstacles.clearance(robot))

    @property
    def heads(self) -> bool:
        """Whether the current target has a heading."""
        return bool(self._heading)

    @property
    def passes(self) -> bool:
        """Whether another target follows the current one."""
        return "next_goal_distance" in self._column

    @property
    def tracks(self) -> bool:
        """Whether the target is a velocity."""
        return "velocity_error_x_in_body" in self._column

    @property
    def crosses_obstacles(self) -> bool:
        """Whether obstacles stand about."""
        return "obstacle_1_x_in_body" in self._column

    def term(self, observation: np.ndarray, name: str) -> np.ndarray:
        """One term, shape (...,)."""
        return np.asarray(observation[..., self._column[name]])

    def goal(self, observation: np.ndarray) -> Vector:
        """Way to the current target in the body's frame; around obstacles, its beginning, as long as all of it."""
        for what in ("goal", "way"):
            if f"{what}_x_in_body" in self._column:
                return self.term(observation, f"{what}_x_in_body"), self.term(
                    observation, f"{what}_y_in_body"
                )
        return self._along(observation, "goal")

    def next_leg(self, observation: np.ndarray) -> Vector:
        """Way from the current target to the one after it, in the body's frame."""
        (x, y), (next_x, next_y) = self._along(observation, "goal"), self._along(observation, "next_goal")
        return next_x - x, next_y - y

    def turn(self, observation: np.ndarray) -> np.ndarray:
        """Wanted heading minus heading, shape (...,) in [-pi, pi] [rad]."""
        cosine, sine = (self.term(observation, name) for name in self._heading)
        return np.asarray(np.arctan2(sine, cosine))

    def motion(self, observation: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Speed ahead [m/s], to the left [m/s] and turn rate [rad/s], shapes (...,)."""
        u, v, r = (
            self.term(observation, name) for name in ("velocity_x_in_body", "velocity_y_in_body", "yaw_rate")
        )
        return u, v, r

    def velocity_error(self, observation: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Wanted minus measured velocity, as of `motion`."""
        u, v, r = (
            self.term(observation, name)
            for name in ("velocity_error_x_in_body", "velocity_error_y_in_body", "yaw_rate_error")
        )
        return u, v, r

    def previous(self, observation: np.ndarray) -> np.ndarray:
        """What was commanded before, shape (..., m), in the actuators' units; zeros where nobody tells."""
        scale = self._actuators.scale
        if not self._actuators.response.remembers:
            return np.zeros((*observation.shape[:-1], len(scale)))
        return np.asarray(observation[..., -len(scale) :] * scale)

    def obstacles(self, observation: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """Centres of the obstacles in sight, in the body's frame, and how wide they are where ways lead around them.

        Args:
            observation: Shape (..., n).

        Returns:
            x and y, shapes (..., k) [m], far away for those that are not there, and the width of all [m].
        """
        x, y = (
            observation[..., [i for name, i in self._column.items() if re.fullmatch(term, name)]]
            for term in (r"obstacle_\d+_x_in_body", r"obstacle_\d+_y_in_body")
        )
        # At the end of sight, or behind it, or not there at all: none of them is in the way yet.
        clear = np.hypot(x, y) > SIGHT - 1e-3
        return np.where(clear, -FAR, x), np.where(clear, 0.0, y), self._wide

    def _along(self, observation: np.ndarray, which: str) -> Vector:
        x, y, distance = (
            self.term(observation, f"{which}_{part}")
            for part in ("direction_x_in_body", "direction_y_in_body", "distance")
        )
        return x * distance, y * distance
