"""One driven run as the estimators see it: where the robot was, and what its actuators were told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.errors import ConfigError


@dataclass(frozen=True)
class Drive:
    """Measured poses and the commands behind them, on one clock."""

    name: str  # for messages
    time_s: np.ndarray  # (n,) of each pose, increasing [s]
    pose: np.ndarray  # (n, 3) x [m], y [m] and heading without jumps [rad], in the world
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
    xy: np.ndarray,
    yaw: np.ndarray,
    command_s: np.ndarray,
    command: np.ndarray,
    *,
    load: int = 0,
) -> Drive:
    """Put a run in order: stamps increase, headings do not jump, commands that say nothing new are dropped.

    Args:
        name: For messages.
        time_s: Stamps of the poses, shape (n,) [s].
        xy: Positions in the world, shape (n, 2) [m].
        yaw: Headings, shape (n,) [rad].
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
    pose = np.column_stack((np.asarray(xy, dtype=float)[kept], np.unwrap(np.asarray(yaw, dtype=float)[kept])))
    order = np.argsort(command_s, kind="stable")
    switch_s, command = np.asarray(command_s, dtype=float)[order], np.asarray(command, dtype=float)[order]
    if not all(np.isfinite(part).all() for part in (time_s, pose, switch_s, command)):
        raise ConfigError(f"{name}: a pose or a command is not finite; leave this bag out.")
    new = np.concatenate(([True], np.any(np.diff(command, axis=0) != 0.0, axis=1)))
    return Drive(name, time_s, pose, switch_s[new], command[new], load)
