"""Base class of the classical laws in the plane: inputs in the body's frame, and speeds at targets and obstacles."""

from __future__ import annotations

import numpy as np

from fulmar_core.controllers.body_frame import BodyFrame, Vector
from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.guidance import passing_speed, room_ahead
from fulmar_core.controllers.law import Law


class PlanarLaw(Law):
    """A law for robots that move in the plane.

    Attributes:
        share_of_speed: How much of the cruising speed may be used [-].
    """

    def bind(self) -> None:
        """See `Law.bind`."""
        self.frame = BodyFrame(self.robot, self.task)
        if self.frame.crosses_obstacles and not self.gains.speed_around:
            raise ValueError("'speed_around' is missing, which says how fast to go among obstacles.")
        self.share_of_speed = float(self.gains.speed_around) if self.frame.crosses_obstacles else 1.0

    @property
    def near(self) -> float:
        """What counts as being there [m]."""
        passed = 0.7 * getattr(self.task, "reach", 0.0) if self.frame.passes else 0.0
        return max(float(self.gains.near), passed)

    def room(self, inputs: Inputs, direction: np.ndarray) -> np.ndarray:
        """What is free in the direction of travel, infinite where nothing stands about; see `room_ahead`."""
        if not self.frame.crosses_obstacles:
            return np.full_like(direction, np.inf)
        return room_ahead(self.frame.obstacles(inputs), direction)

    def last_speed(self, goal: Vector, inputs: Inputs, *, cruise: np.ndarray | float) -> np.ndarray:
        """Speed at the current target, shape (...,) [m/s]: that of passing it, or none where the robot shall stay.

        Args:
            goal: Way to the target, shapes (...,) [m].
            inputs: Hold where the next one is.
            cruise: Speed where the path goes straight on [m/s].
        """
        if not self.frame.passes:
            return np.zeros_like(goal[0])
        leg = self.frame.next_leg(inputs)
        return passing_speed(goal, leg, cruise=cruise, corner=self.gains.corner)
