"""Following a path by aiming at a point ahead of the robot, as DRIFT does.

RANS mujoco_envs/controllers/hl_controllers.py: constant speed towards a point a little further along the path.
RoboRAN's deployment does the same for wheeled robots and turns the aim into a turn rate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fulmar_core.states.rotation import wrap_angle
from fulmar_core.tasks.references import ReferencePath

MOST_LOOK_AHEAD = 0.25  # of a path's length: the nearest point is searched over twice as much
POINTS = 3600  # of a path: RANS mujoco_envs/controllers/hl_controllers.py


@dataclass(frozen=True, slots=True)
class Progress:
    """How far along its path a robot has come."""

    index: int = 0  # the nearest point so far
    laps: int = 0  # whole rounds; of an open path 1 at its end


@dataclass(frozen=True)
class LookAhead:
    """What to follow and how; the path does not change, the progress is the caller's."""

    points: np.ndarray  # (n, 2) equally spaced [m]
    closed: bool
    speed: float  # [m/s]
    look_ahead: float  # how far along the path the aim lies before the nearest point [m]
    loops: int = 1  # rounds of a closed path; 0 means for ever

    def __post_init__(self) -> None:
        if self.speed <= 0.0 or self.look_ahead <= 0.0:
            raise ValueError("'speed' and 'look_ahead' must be greater than 0.")
        if self.loops < 0:
            raise ValueError("'loops' must not be negative; 0 means for ever.")
        most = MOST_LOOK_AHEAD * self.spacing * len(self.points)
        if not self.look_ahead <= most:
            raise ValueError(
                f"'look_ahead' = {self.look_ahead:g} m is too far for this path: at most a quarter of its length, "
                f"{most:.3g} m."
            )

    @cached_property
    def spacing(self) -> float:
        """Distance of neighbouring points [m]."""
        return float(np.median(np.linalg.norm(np.diff(self.points, axis=0), axis=1)))

    def nearest(self, position_xy: np.ndarray) -> Progress:
        """Progress of a robot that may begin anywhere on the path: at its nearest point."""
        return Progress(int(np.argmin(np.linalg.norm(self.points - position_xy, axis=1))))

    def is_done(self, progress: Progress) -> bool:
        """Whether an open path is at its end, or a closed one has had its rounds."""
        return progress.laps >= 1 if not self.closed else 0 < self.loops <= progress.laps

    def aim(self, progress: Progress, position_xy: np.ndarray) -> tuple[np.ndarray, Progress]:
        """Velocity towards the aim.

        The nearest point is searched from the last one on, no further than twice the look-ahead distance: progress
        never goes back, and a path that crosses itself is followed in its own order. An open path is over once its end
        is no farther than the look-ahead distance.

        Args:
            progress: Result of the last call, or where to begin.
            position_xy: Where the robot is, shape (2,) [m].

        Returns:
            Velocity in the world, shape (2,) [m/s], 0 once the path is done; and the new progress.
        """
        count = len(self.points)
        ahead = max(1, round(self.look_ahead / self.spacing))
        window = np.arange(progress.index, progress.index + min(2 * ahead, count - 1) + 1)
        if not self.closed:
            window = np.minimum(window, count - 1)
        offsets = self.points[window % count] - position_xy
        squared = np.sum(offsets * offsets, axis=1)
        index = int(window[np.argmin(squared)])
        if self.closed:
            progress = Progress(index % count, progress.laps + index // count)
            target = self.points[(index + ahead) % count]
        else:
            progress = Progress(index, int(index == count - 1 and squared.min() <= self.look_ahead**2))
            target = self.points[min(index + ahead, count - 1)]
        way = target - position_xy
        distance = float(np.linalg.norm(way))
        if self.is_done(progress) or distance == 0.0:
            return np.zeros(2), progress
        return np.asarray(way * (self.speed / distance)), progress


def follow(path: ReferencePath, *, speed: float, look_ahead: float, loops: int = 1) -> LookAhead:
    """Planner for one path; arguments as in `LookAhead`."""
    return LookAhead(path.points(POINTS), path.closed, speed, look_ahead, loops)


def body_target(velocity_in_world: np.ndarray, yaw: float) -> np.ndarray:
    """Body velocity of a robot that can move sideways: the same velocity, without turning.

    Args:
        velocity_in_world: Shape (2,) [m/s].
        yaw: Heading [rad].

    Returns:
        v_x, v_y, yaw rate, shape (3,) [m/s, m/s, rad/s].
    """
    cos, sin = math.cos(yaw), math.sin(yaw)
    vx, vy = velocity_in_world
    return np.array([cos * vx + sin * vy, cos * vy - sin * vx, 0.0])


def steered_target(
    velocity_in_world: np.ndarray, yaw: float, *, gain: float = 0.5, max_yaw_rate: float = 0.5
) -> np.ndarray:
    """Body velocity of a robot that cannot move sideways: full speed ahead, turning towards the aim.

    RoboRAN's deployment: yaw rate = clamp(0.5 bearing, ±0.5), no lateral speed.

    Args:
        velocity_in_world: Shape (2,) [m/s].
        yaw: Heading [rad].
        gain: Yaw rate for each radian of bearing [1/s].
        max_yaw_rate: [rad/s].

    Returns:
        v_x, 0, yaw rate, shape (3,) [m/s, m/s, rad/s]; all 0 where the velocity is.
    """
    speed = float(np.linalg.norm(velocity_in_world))
    if speed == 0.0:
        return np.zeros(3)
    bearing = float(wrap_angle(np.asarray(math.atan2(velocity_in_world[1], velocity_in_world[0]) - yaw)))
    return np.array([speed, 0.0, min(max(gain * bearing, -max_yaw_rate), max_yaw_rate)])
