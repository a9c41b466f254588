"""Driven runs cut into windows of one length, each with a start of its own.

A window forgets: a disturbance that the model does not know spoils a few seconds instead of everything after it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fulmar_core.errors import ConfigError
from fulmar_core.identification.drive import Drive

LEAST_SAMPLES = 5  # in a window: fewer say nothing beyond its start


@dataclass(frozen=True)
class Windows:
    """Windows on a grid of integration steps."""

    drives: tuple[Drive, ...]
    drive: np.ndarray  # (w,) which run each window is of
    begin_s: np.ndarray  # (w,) [s]
    steps: int  # integration steps in each
    dt: float  # [s]
    pose: np.ndarray  # (w, n, 3) measured; padded
    below: np.ndarray  # (w, n) grid point before each measurement
    share: np.ndarray  # (w, n) how far on it is towards the next grid point, 0 to 1
    valid: np.ndarray  # (w, n) False where it is padded

    def __len__(self) -> int:
        """Number of windows."""
        return len(self.drive)

    @property
    def load(self) -> np.ndarray:
        """Which ballast was aboard, shape (w,)."""
        return np.array([self.drives[i].load for i in self.drive])

    def first_states(self) -> np.ndarray:
        """Pose and velocity at the beginning of each window, from a parabola through its first second, shape (6, w)."""
        states = np.zeros((6, len(self)))
        for w in range(len(self)):
            t = (self.below[w] + self.share[w]) * self.dt
            early = self.valid[w] & (t <= max(1.0, float(np.sort(t[self.valid[w]])[LEAST_SAMPLES - 1])))
            basis = np.stack((np.ones(early.sum()), t[early], t[early] ** 2), axis=1)
            parabola = np.linalg.lstsq(basis, self.pose[w, early], rcond=None)[0]
            states[:3, w], states[3:, w] = parabola[0], parabola[1]
        return states

    def at_measurements(self, grid: np.ndarray) -> np.ndarray:
        """Values at the times of the measurements.

        Args:
            grid: Values at the grid points, shape (steps + 1, 3, copies, w).

        Returns:
            Shape (copies, w, n, 3).
        """
        each = np.arange(len(self))[:, None]
        by_window = np.moveaxis(grid, (0, 1, 2, 3), (1, 3, 2, 0))  # (w, steps + 1, copies, 3)
        low = by_window[each, self.below]
        high = by_window[each, np.minimum(self.below + 1, self.steps)]
        between = low + self.share[:, :, None, None] * (high - low)
        return np.moveaxis(between, 2, 0)


def cut(drives: Sequence[Drive], *, length_s: float, dt: float) -> Windows:
    """Cut runs into windows; what is left at their ends is not used.

    Args:
        drives: The runs.
        length_s: Length of a window [s].
        dt: Integration step [s].

    Returns:
        The windows.

    Raises:
        ConfigError: No run is as long as that.
    """
    steps = max(1, round(length_s / dt))
    which, begin, poses, places = [], [], [], []
    for number, drive in enumerate(drives):
        for k in range(int((drive.duration_s + 0.5 * dt) / (steps * dt))):
            start = float(drive.time_s[0]) + k * steps * dt
            place = (drive.time_s - start) / dt
            inside = (place > -1e-6) & (place <= steps + 1e-6)
            if inside.sum() < LEAST_SAMPLES:
                continue
            which.append(number)
            begin.append(start)
            poses.append(drive.pose[inside])
            places.append(np.clip(place[inside], 0.0, steps))
    if not which:
        longest = max((drive.duration_s for drive in drives), default=0.0)
        raise ConfigError(
            f"the longest of {len(drives)} runs has {longest:.1f} s; at least {length_s:g} s with "
            f"{LEAST_SAMPLES} poses are needed. Drive for longer: fulmar run ROBOT --controller excite --duration 120"
        )
    most = max(len(place) for place in places)
    count = len(which)
    pose, place = np.zeros((count, most, 3)), np.zeros((count, most))
    valid = np.zeros((count, most), dtype=bool)
    for w, (some, where) in enumerate(zip(poses, places, strict=True)):
        pose[w, : len(where)], place[w, : len(where)], valid[w, : len(where)] = some, where, True
    below = np.minimum(np.floor(place + 1e-9).astype(int), steps)
    return Windows(
        tuple(drives), np.array(which), np.array(begin), steps, dt, pose, below, place - below, valid
    )
