"""A target that moves along a path in space, between its ends at a constant speed: its pose at any time."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from fulmar_core.states.attitude import from_euler
from fulmar_core.tasks.references.in_space import Place, SpacePath

POINTS = 3600  # of a path, as of those in the plane
NEAREST_GAZE = 1e-3  # of what is faced, by how far it is at most [-]
Facing = Literal["along_path", "point", "fixed", "any"]


@dataclass(frozen=True)
class MovingTarget:
    """What moves, and how; see `Trajectory` of `goal_files`."""

    path: SpacePath
    speed: float  # [m/s]
    facing: Facing
    angles_deg: tuple[float, float, float]  # roll, pitch, yaw that `fixed` keeps [deg]
    loops: int  # rounds of a closed path; 0 means for ever
    point: Place | None = None  # that `point` faces; None: the path's centre [m]
    ease_s: float = 0.0  # in which it gets up to its speed, and to rest at the end [s]

    @cached_property
    def points(self) -> np.ndarray:
        """Equally spaced points of one round, shape (n, 3) [m]; a closed path's last one is its first."""
        points = self.path.points(POINTS)
        return np.concatenate((points, points[:1])) if self.path.closed else points

    @cached_property
    def round_s(self) -> float:
        """Time of one round, or of an open path, at its speed [s]."""
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum()) / self.speed

    @property
    def duration_s(self) -> float:
        """Time until it stands still; infinite for endless rounds [s]."""
        rounds = self.loops or np.inf if self.path.closed else 1
        return rounds * self.round_s + self.ease_s

    def rounds(self, time_s: float) -> float:
        """Rounds, or of an open path the share, that lie behind it at a time, no more than there are."""
        late, ease_s = max(0.0, min(time_s, self.duration_s)), self.ease_s
        left = self.duration_s - late
        if left < late:  # the end mirrors the begin
            return (self.duration_s - ease_s - self._eased(left)) / self.round_s
        return self._eased(late) / self.round_s

    def _eased(self, time_s: float) -> float:
        """Time at its speed for the way that it goes from rest; the speed grows as 3 τ² − 2 τ³ of `ease_s`."""
        if time_s >= self.ease_s:
            return time_s - 0.5 * self.ease_s
        share = time_s / self.ease_s
        return self.ease_s * (share**3 - 0.5 * share**4)

    def pose(self, time_s: float) -> np.ndarray:
        """Where it is at a time, shape (7,): place [m], quaternion x, y, z, w."""
        return self.pose_after(self.rounds(time_s))

    def pose_after(self, rounds: float) -> np.ndarray:
        """The same after so many rounds, or such a share of an open path."""
        points, count = self.points, len(self.points) - 1
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
        if self.facing == "point":
            mixed = (1.0 - part) * self._gazes[whole] + part * self._gazes[whole + 1]
            return np.asarray(mixed / np.linalg.norm(mixed))
        ahead = (1.0 - part) * self._tangent(whole) + part * self._tangent(whole + 1)
        x = ahead / np.linalg.norm(ahead)
        z = self.path.up - (self.path.up @ x) * x
        z /= np.linalg.norm(z)
        return _quaternion(np.column_stack((x, np.cross(z, x), z)))

    @cached_property
    def _gazes(self) -> np.ndarray:
        """Attitudes at the points with x towards one place, quaternions of one sign, shape (n, 4).

        From point to point the body turns by the least rotation that keeps x there, so that it rolls nowhere (parallel
        transport; Bishop, "There is more than one way to frame a curve", 1975). What a closed path leaves of a roll
        after a round is spread over it.
        """
        ways = np.array(self.path.centre if self.point is None else self.point) - self.points
        far = np.linalg.norm(ways, axis=1, keepdims=True)
        if far.min() < NEAREST_GAZE * far.max():
            raise ValueError("the path passes through the place that it faces. Give another 'point'.")
        x = ways / far
        ups = [_across(self.path.up, x[0])]
        for before, after in itertools.pairwise(x):
            axis, cosine = _cross(before, after), float(before @ after)
            carried = cosine * ups[-1] + _cross(axis, ups[-1]) + axis * (axis @ ups[-1]) / (1.0 + cosine)
            ups.append(_across(carried, after))
        z = np.array(ups)
        if self.path.closed:
            left = np.arctan2(np.cross(z[-1], z[0]) @ x[0], z[-1] @ z[0])
            roll = np.linspace(0.0, left, len(z))[:, None]
            z = np.cos(roll) * z + np.sin(roll) * np.cross(x, z)
        quats = [_quaternion(axes) for axes in np.stack((x, np.cross(z, x), z), axis=-1)]
        for before, after in itertools.pairwise(quats):
            after *= 1.0 if before @ after >= 0.0 else -1.0
        return np.array(quats)

    def acceleration(self) -> float:
        """The largest that it takes to stay on the path, the square of the speed by the radius of a bend [m/s²]."""
        points = self.points
        if self.path.closed:
            points = np.concatenate((points, points[1:2]))
        legs = np.diff(points, axis=0)
        lengths = np.linalg.norm(legs, axis=1)
        ways = legs / lengths[:, None]
        bends = np.linalg.norm(np.diff(ways, axis=0), axis=1) / (0.5 * (lengths[1:] + lengths[:-1]))
        return float(self.speed**2 * bends.max())

    def _tangent(self, index: int) -> np.ndarray:
        """Direction of the path at a point, from those beside it."""
        points, last = self.points, len(self.points) - 1
        if self.path.closed:
            return np.asarray(points[(index + 1) % last] - points[(index - 1) % last])
        return np.asarray(points[min(index + 1, last)] - points[max(index - 1, 0)])


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross product of two vectors, to the last bit that of `np.cross`, which takes far longer for a single pair."""
    return np.array(
        (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]), dtype=float
    )


def _across(way: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Unit vector nearest to a way that is perpendicular to x; any such one where the way lies along x."""
    across = way - (way @ x) * x
    if np.linalg.norm(across) < 1e-9:
        across = np.cross(x, np.eye(3)[np.argmin(np.abs(x))])
    return np.asarray(across / np.linalg.norm(across))


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
