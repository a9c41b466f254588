"""Driven runs for identification: poses with commands, and windows cut from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fulmar_core.config.errors import ConfigError


@dataclass(frozen=True)
class Drive:
    """One driven run: measured poses and the commands behind them, on one clock."""

    name: str  # for messages
    time_s: np.ndarray  # (n,) of each pose, increasing [s]
    # (n, 3) x [m], y [m] and heading without jumps [rad], in the world; or in space (n, 7) x, y, z [m] and twice the
    # quaternion without jumps of its sign, whose errors then are angles [rad]
    pose: np.ndarray
    switch_s: np.ndarray  # (k,) when each command began, increasing [s]
    command: np.ndarray  # (k, m) as the actuators took it
    load: int = 0  # which ballast was aboard; 0: none

    @property
    def duration_s(self) -> float:
        """From the first pose to the last one [s]."""
        return float(self.time_s[-1] - self.time_s[0])


def drive_of(
    name: str,
    time_s: np.ndarray,
    pose: np.ndarray,
    command_s: np.ndarray,
    command: np.ndarray,
    *,
    load: int = 0,
) -> Drive:
    """Put a run in order: stamps increase, angles do not jump, commands that say nothing new are dropped.

    Args:
        name: For messages.
        time_s: Stamps of the poses, shape (n,) [s].
        pose: In the world, shape (n, 3): x, y [m] and heading [rad]; or, in space, (n, 7): x, y, z and quaternion xyzw.
        command_s: Stamps of the commands, shape (k,) [s].
        command: Commands, shape (k, m).
        load: Number of the ballast that was aboard; 0 for none.

    Returns:
        The run.

    Raises:
        ConfigError: There are too few poses or no commands, or a value is not finite.
    """
    if len(time_s) < 2 or len(command_s) < 1:
        raise ConfigError(
            f"{name}: {len(time_s)} poses and {len(command_s)} commands; a driven run has many of both. "
            "Record one with: fulmar run ROBOT --controller excite"
        )
    time_s, kept = np.unique(np.asarray(time_s, dtype=float), return_index=True)
    pose = _without_jumps(np.array(pose, dtype=float)[kept])
    order = np.argsort(command_s, kind="stable")
    switch_s, command = np.asarray(command_s, dtype=float)[order], np.asarray(command, dtype=float)[order]
    if not all(np.isfinite(part).all() for part in (time_s, pose, switch_s, command)):
        raise ConfigError(f"{name}: a pose or a command is not finite; leave this bag out.")
    new = np.concatenate(([True], np.any(np.diff(command, axis=0) != 0.0, axis=1)))
    return Drive(name, time_s, pose, switch_s[new], command[new], load)


def _without_jumps(pose: np.ndarray) -> np.ndarray:
    """Poses as `Drive.pose` has them."""
    if pose.shape[1] == 3:
        return np.column_stack((pose[:, :2], np.unwrap(pose[:, 2])))
    turned = np.sum(pose[1:, 3:] * pose[:-1, 3:], axis=1) < 0.0
    pose[1:, 3:] *= np.where(np.cumsum(turned) % 2, -1.0, 1.0)[:, None]
    pose[:, 3:] *= 2.0
    return pose


LEAST_SAMPLES = 5  # in a window: fewer say nothing beyond its start


@dataclass(frozen=True)
class Windows:
    """Windows of one length on a grid of integration steps, each with a start of its own.

    A window forgets: a disturbance that the model does not know spoils a few seconds instead of everything after it.
    """

    drives: tuple[Drive, ...]
    drive: np.ndarray  # (w,) which run each window is of
    begin_s: np.ndarray  # (w,) [s]
    steps: int  # integration steps in each
    dt: float  # [s]
    pose: np.ndarray  # (w, n, 3 or 7) measured; padded
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
        """Pose and velocity at the beginning of each window, from a parabola through its first second.

        Returns:
            Shape (6, w), or in space (14, w).
        """
        width = self.pose.shape[-1]
        states = np.zeros((2 * width, len(self)))
        for w in range(len(self)):
            t = (self.below[w] + self.share[w]) * self.dt
            early = self.valid[w] & (t <= max(1.0, float(np.sort(t[self.valid[w]])[LEAST_SAMPLES - 1])))
            basis = np.stack((np.ones(early.sum()), t[early], t[early] ** 2), axis=1)
            parabola = np.linalg.lstsq(basis, self.pose[w, early], rcond=None)[0]
            states[:width, w], states[width:, w] = parabola[0], parabola[1]
        return states

    def at_measurements(self, grid: np.ndarray) -> np.ndarray:
        """Values at the times of the measurements.

        Args:
            grid: Values at the grid points, shape (steps + 1, channels, copies, w).

        Returns:
            Shape (copies, w, n, channels).
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
            poses.append(_by_sign(drive.pose[inside]))
            places.append(np.clip(place[inside], 0.0, steps))
    if not which:
        longest = max((drive.duration_s for drive in drives), default=0.0)
        raise ConfigError(
            f"the longest of {len(drives)} runs has {longest:.1f} s; at least {length_s:g} s with "
            f"{LEAST_SAMPLES} poses are needed. Drive for longer: fulmar run ROBOT --controller excite --duration 120"
        )
    most = max(len(place) for place in places)
    count = len(which)
    pose, place = np.zeros((count, most, poses[0].shape[1])), np.zeros((count, most))
    valid = np.zeros((count, most), dtype=bool)
    for w, (some, where) in enumerate(zip(poses, places, strict=True)):
        pose[w, : len(where)], place[w, : len(where)], valid[w, : len(where)] = some, where, True
    below = np.minimum(np.floor(place + 1e-9).astype(int), steps)
    return Windows(
        tuple(drives), np.array(which), np.array(begin), steps, dt, pose, below, place - below, valid
    )


def _by_sign(pose: np.ndarray) -> np.ndarray:
    """Poses of a window; in space with the quaternion's sign so that it begins within half a turn."""
    if pose.shape[1] == 7 and pose[0, 6] < 0.0:
        return np.concatenate((pose[:, :3], -pose[:, 3:]), axis=1)
    return pose
