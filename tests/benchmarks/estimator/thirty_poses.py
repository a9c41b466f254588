"""The velocity that RoboRAN's deployment computes: the mean of the differences between its last 30 poses.

Its time span is divided by the number of poses, not of differences, which makes every velocity 30/29 of what it is
(snt-spacer RoboRAN deployment, state preprocessor "Optitrack").
"""

from __future__ import annotations

from collections import deque

import numpy as np

POSES = 30


class ThirtyPoses:
    """The mean over a buffer."""

    def __init__(self) -> None:
        """Begin empty."""
        self._poses: deque[tuple[float, np.ndarray]] = deque(maxlen=POSES)

    def see_pose(self, time_s: float, pose: np.ndarray) -> None:
        """Note a pose (x [m], y [m], continuous yaw [rad]), captured at a time [s]."""
        self._poses.append((time_s, pose))

    def motion(self) -> np.ndarray | None:
        """Velocity in the world [m/s] and turn rate [rad/s], shape (3,); None before the buffer is full."""
        if len(self._poses) < POSES:
            return None
        (first_s, first), (last_s, last) = self._poses[0], self._poses[-1]
        mean_difference = (last - first) / (POSES - 1)
        return np.asarray(mean_difference / ((last_s - first_s) / POSES))
