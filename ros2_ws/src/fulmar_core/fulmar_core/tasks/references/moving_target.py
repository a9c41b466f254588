"""A target that moves along a path in space at a constant speed: its pose at any time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from fulmar_core.states.attitude import from_euler
from fulmar_core.tasks.references.in_space import SpacePath

POINTS = 3600  # of a path, as of those in the plane
Facing = Literal["along_path", "fixed", "any"]


@dataclass(frozen=True)
class MovingTarget:
    """What moves, and how; see `Trajectory` of `goal_files`."""

    path: SpacePath
    speed: float  # [m/s]
    facing: Facing
    angles_deg: tuple[float, float, float]  # roll, pitch, yaw that `fixed` keeps [deg]
    loops: int  # rounds of a closed path; 0 means for ever

    @cached_property
    def points(self) -> np.ndarray:
        """Equally spaced points of one round, shape (n, 3) [m]; a closed path's last one is its first."""
        points = self.path.points(POINTS)
        return np.concatenate((points, points[:1])) if self.path.closed else points

    @cached_property
    def round_s(self) -> float:
        """Time of one round, or of an open path [s]."""
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum()) / self.speed

    @property
    def duration_s(self) -> float:
        """Time until it stands still; infinite for endless rounds [s]."""
        if not self.path.closed:
            return self.round_s
        return self.loops * self.round_s if self.loops else np.inf

    def rounds(self, time_s: float) -> float:
        """Rounds, or of an open path the share, that lie behind it at a time, no more than there are."""
        return min(time_s, self.duration_s) / self.round_s

    def pose(self, time_s: float) -> np.ndarray:
        """Where it is at a time, shape (7,): place [m], quaternion x, y, z, w."""
        points, count = self.points, len(self.points) - 1
        rounds = self.rounds(time_s)
        share = rounds % 1.0 if self.path.closed else rounds
        whole = min(int(share * count), count - 1)
        part = share * count - whole
        place = (1.0 - part) * points[whole] + part * points[whole + 1]
        return np.concatenate((place, self._attitude(whole, part)))

    def _attitude(self, whole: int, part: float) -> np.ndarray:
        if self.facing == "any":
            return np.array([0.0, 0.0, 0.0, 1.0])
        if self.facing == "fixed":
            return np.array(from_euler(*np.deg2rad(self.angles_deg)))
        ahead = (1.0 - part) * self._tangent(whole) + part * self._tangent(whole + 1)
        x = ahead / np.linalg.norm(ahead)
        z = self.path.up - (self.path.up @ x) * x
        z /= np.linalg.norm(z)
        return _quaternion(np.column_stack((x, np.cross(z, x), z)))

    def _tangent(self, index: int) -> np.ndarray:
        """Direction of the path at a point, from those beside it."""
        points, last = self.points, len(self.points) - 1
        if self.path.closed:
            return np.asarray(points[(index + 1) % last] - points[(index - 1) % last])
        return np.asarray(points[min(index + 1, last)] - points[max(index - 1, 0)])


def _quaternion(axes: np.ndarray) -> np.ndarray:
    """Unit quaternion x, y, z, w of a rotation matrix, by the largest of its entries (Shepperd's method)."""
    m, trace = axes, float(np.trace(axes))
    squares = np.array([*(2.0 * np.diag(m) - trace), trace]) + 1.0  # four times the square of each entry
    i = int(np.argmax(squares))
    if i == 3:
        quat = np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], squares[3]])
    else:
        j, k = (i + 1) % 3, (i + 2) % 3
        quat = np.zeros(4)
        quat[i], quat[j], quat[k] = squares[i], m[j, i] + m[i, j], m[k, i] + m[i, k]
        quat[3] = m[k, j] - m[j, k]
    return np.asarray(quat / np.linalg.norm(quat))
