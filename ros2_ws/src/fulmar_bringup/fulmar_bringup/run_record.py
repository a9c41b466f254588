"""One recorded run as arrays: what was true, measured, commanded, applied and reported."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_core.state import RigidBodyState


@dataclass(frozen=True)
class Motion:
    """States of one body over time; all arrays begin with the same axis."""

    stamp_s: np.ndarray  # (n,) time of measurement [s]
    log_s: np.ndarray  # (n,) when the recorder received it, by its wall clock [s]
    publish_s: np.ndarray  # (n,) when it was sent, by the sender's wall clock [s]
    position: np.ndarray  # (n, 3) in the world [m]
    quat_xyzw: np.ndarray  # (n, 4) [-]
    velocity_in_world: np.ndarray  # (n, 3) [m/s]
    yaw_rate: np.ndarray  # (n,) [rad/s]

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.stamp_s)

    def between(self, begin_s: float, end_s: float) -> Motion:
        """The samples of a span of time, both ends included [s]."""
        inside = (self.stamp_s >= begin_s) & (self.stamp_s <= end_s)
        return Motion(*(getattr(self, column.name)[inside] for column in fields(self)))

    @property
    def states(self) -> RigidBodyState:
        """The same as a batch of states."""
        turn = np.zeros((len(self), 3))
        turn[:, 2] = self.yaw_rate
        return RigidBodyState(self.position, self.quat_xyzw, self.velocity_in_world, turn)


@dataclass(frozen=True)
class Actuation:
    """Actuator vectors over time."""

    stamp_s: np.ndarray  # (n,) [s]
    log_s: np.ndarray  # (n,) [s]
    publish_s: np.ndarray  # (n,) [s]
    names: tuple[str, ...]  # of the columns
    effort: np.ndarray  # (n, m)

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.stamp_s)


@dataclass(frozen=True)
class Places:
    """Where one thing of the task was over time."""

    stamp_s: np.ndarray  # (n,) [s]
    pose: np.ndarray  # (n, 3) in the world [m, m, rad]

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.stamp_s)


@dataclass(frozen=True)
class GivenGoal:
    """A goal as it was given."""

    stamp_s: float  # [s]
    log_s: float  # [s]
    targets: np.ndarray  # (k, 3) as in `fulmar_core.goal.Goal`


@dataclass(frozen=True)
class HealthSample:
    """One diagnostic status."""

    log_s: float  # [s]
    name: str  # `<robot>: plant`, `<robot>: controller`
    level: int  # 0 ok, 1 warn, 2 error, 3 stale
    message: str
    values: dict[str, str]


@dataclass(frozen=True)
class RunRecord:
    """Everything a bag tells about one run."""

    path: Path
    info: dict[str, Any]  # what was asked for
    truth: Motion
    odom: Motion
    applied: Actuation  # `actuators/state`
    commanded: Actuation  # `actuators/command`; the stamp is that of the observation it answers
    goals: tuple[GivenGoal, ...]
    obstacles: np.ndarray  # (m, 3) x [m], y [m], radius [m]; those given last
    things: dict[str, Places]  # by name, those that the bag has
    controller: dict[str, Any]  # its metadata
    health: tuple[HealthSample, ...]
    warnings: tuple[str, ...]  # what could not be read

    @property
    def actuation(self) -> Actuation:
        """What was applied; where the bag does not tell, what was commanded."""
        return self.applied if len(self.applied) else self.commanded

    @property
    def motion(self) -> Motion:
        """The truth where there is one, else the odometry.

        A real robot is measured before and after its run, too; only what lies within belongs to it.
        """
        motion = self.truth if len(self.truth) else self.odom
        if self.info.get("backend") != "hardware" or not len(self.applied):
            return motion
        began_s = float(self.applied.stamp_s[0])
        return motion.between(began_s, began_s + float(self.info.get("duration_s") or np.inf))

    def last_health(self, part: str) -> HealthSample | None:
        """Newest status of `plant` or `controller`, None if there is none."""
        mine = (sample for sample in reversed(self.health) if sample.name.endswith(f": {part}"))
        return next(mine, None)
