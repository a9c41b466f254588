"""Goal files: `configs/goals/<name>.yaml`, distinguished by `kind`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, cast

import numpy as np

from fulmar_core.config import load_config
from fulmar_core.paths import config_path
from fulmar_core.references import ReferencePath
from fulmar_core.references.look_ahead import LookAhead, follow

_RADIANS = np.array([1.0, 1.0, np.pi / 180.0])  # of what is written as (length, length, degrees)


@dataclass(frozen=True)
class Positions:
    """Positions to visit in order."""

    kind: Literal["positions"]
    title: str
    positions: tuple[tuple[float, float], ...]  # x, y in the world [m, m]

    def __post_init__(self) -> None:
        if not self.positions:
            raise ValueError("'positions' must have at least one entry.")

    def targets(self) -> np.ndarray:
        """x, y and a heading of 0 that does not matter, shape (n, 3) [m, m, rad]."""
        return np.array([(x, y, 0.0) for x, y in self.positions])


@dataclass(frozen=True)
class Poses:
    """Poses to take in order."""

    kind: Literal["poses"]
    title: str
    poses: tuple[tuple[float, float, float], ...]  # x, y, heading in the world [m, m, deg]

    def __post_init__(self) -> None:
        if not self.poses:
            raise ValueError("'poses' must have at least one entry.")

    def targets(self) -> np.ndarray:
        """x, y and heading, shape (n, 3) [m, m, rad]."""
        return np.asarray(np.array(self.poses) * _RADIANS)


@dataclass(frozen=True)
class HeldVelocity:
    """One velocity for some time."""

    velocity: tuple[float, float, float]  # ahead, to the left, turning, in the body frame [m/s, m/s, deg/s]
    hold_s: float  # [s]

    def __post_init__(self) -> None:
        if self.hold_s <= 0.0:
            raise ValueError("'hold_s' must be greater than 0.")


@dataclass(frozen=True)
class Velocities:
    """Velocities to keep one after the other."""

    kind: Literal["velocities"]
    title: str
    velocities: tuple[HeldVelocity, ...]

    def __post_init__(self) -> None:
        if not self.velocities:
            raise ValueError("'velocities' must have at least one entry.")

    def targets(self) -> np.ndarray:
        """Velocities in the body frame, shape (n, 3) [m/s, m/s, rad/s]."""
        return np.asarray(np.array([held.velocity for held in self.velocities]) * _RADIANS)

    def ends(self) -> np.ndarray:
        """Time at which each is over, shape (n,) [s]."""
        return np.cumsum([held.hold_s for held in self.velocities])


@dataclass(frozen=True)
class FollowedPath:
    """A path to follow by looking ahead."""

    kind: Literal["path"]
    title: str
    path: ReferencePath
    speed: float  # [m/s]
    look_ahead: float  # how far along the path the aim lies [m]
    loops: int = 1  # rounds of a closed path; 0 means for ever
    turn_gain: float = 0.5  # yaw rate for each radian of bearing, of robots that cannot move sideways [1/s]
    max_yaw_rate_deg: float = 28.65  # of the same; 0.5 rad/s in RoboRAN's deployment [deg/s]
    # The velocity is that of where the robot will be so much later: a command counts until the next one comes [s].
    lead_s: float = 0.0

    def __post_init__(self) -> None:
        if min(self.speed, self.look_ahead, self.turn_gain, self.max_yaw_rate_deg) <= 0.0:
            raise ValueError("speed, look_ahead, turn_gain and max_yaw_rate_deg must be greater than 0.")
        if self.loops < 0:
            raise ValueError("'loops' must not be negative; 0 means for ever.")
        if self.lead_s < 0.0:
            raise ValueError("'lead_s' must not be negative.")

    def planner(self) -> LookAhead:
        """What aims along the path."""
        return follow(self.path, speed=self.speed, look_ahead=self.look_ahead, loops=self.loops)


GoalFile = Positions | Poses | Velocities | FollowedPath


def single_goal(place: tuple[float, ...]) -> Positions | Poses:
    """One place x [m], y [m] and, for a pose, heading [deg], as a goal file would hold it."""
    x, y, *heading = place
    if not heading:
        return Positions("positions", f"position x = {x:g} m, y = {y:g} m", ((x, y),))
    title = f"pose x = {x:g} m, y = {y:g} m, heading = {heading[0]:g} deg"
    return Poses("poses", title, ((x, y, heading[0]),))


def load_goals(name: str) -> GoalFile:
    """Read `configs/goals/<name>.yaml`, or a file anywhere whose path ends in `.yaml`.

    Raises:
        ConfigError: Unknown name, or a mistake in the file.
    """
    path = Path(name) if name.endswith(".yaml") else config_path("goals", name)
    return cast(GoalFile, load_config(GoalFile, path))  # type: ignore[arg-type]
