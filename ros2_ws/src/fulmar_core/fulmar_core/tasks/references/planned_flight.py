"""A named path as a flight of one robot: its speed, its poses over time, and what it asks for."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Performance, Robot
from fulmar_core.states.attitude import angle_between, conjugate, logarithm, product
from fulmar_core.states.spatial import quat_of
from fulmar_core.tasks.references.moving_target import Facing, MovingTarget
from fulmar_core.tasks.references.named_paths import named_path
from fulmar_core.worlds.structures import KeepOut

FINE = 1200  # poses of one round that others lie between in a straight line
ORIGIN = (0.0, 0.0, 0.0)
LOOKS_AHEAD = (0.0, 0.0, 0.0, 1.0)  # attitude of what looks along the body's x axis
STEADY = 0.9  # of the turn rate, that a path may ask for where the body looks along it [-]
TURNING = 0.5  # of what the torque gives, that a path may ask for [-]
Quat = tuple[float, float, float, float]


@dataclass(frozen=True)
class Pace:
    """How fast a path is flown."""

    speed: float  # at most, and no more than the robot's own [m/s]
    share: float = 0.5  # of the acceleration that the robot sustains, at most, in the tightest bend [-]
    fixed: float = 0.0  # speed in the place of these two; 0: by them [m/s]
    ease_s: float = 10.0  # from rest to that speed, and back in the end [s]

    def __post_init__(self) -> None:
        if min(self.speed, self.share) <= 0.0 or min(self.fixed, self.ease_s) < 0.0:
            raise ValueError("'speed' and 'share' must be greater than 0, 'fixed' and 'ease_s' not negative.")


@dataclass(frozen=True)
class Flight:
    """A path that one robot flies, from rest to rest."""

    name: str  # of the path
    target: MovingTarget
    looks: Quat  # attitude in the body of what faces what the path faces

    @functools.cached_property
    def table(self) -> np.ndarray:
        """Poses of one round, evenly along the path, shape (FINE + 1, 7)."""
        ends = np.arange(FINE + 1) / FINE
        # The last pose of a closed path is its first again, which the target would begin anew.
        ends[-1] -= 1e-12 if self.target.path.closed else 0.0
        poses = np.stack([self.target.pose_after(share) for share in ends])
        body = product(quat_of(poses), tuple(np.asarray(conjugate(self.looks))))
        return of_one_sign(np.concatenate((poses[:, :3], np.stack(body, axis=-1)), axis=-1))

    @property
    def closed(self) -> bool:
        """Whether it ends where it began."""
        return self.target.path.closed

    @property
    def duration_s(self) -> float:
        """Of one whole round, or of an open path, with getting up to speed and to rest [s]."""
        return self.target.round_s + self.target.ease_s

    def rounds(self, times: np.ndarray) -> np.ndarray:
        """Rounds that lie behind at some times, shape (k,); no more than one."""
        return np.array([self.target.rounds(time) for time in times])

    def check(self, robot: Robot, keep_outs: tuple[KeepOut, ...], what: str) -> None:
        """Refuse it before anything moves where the robot cannot fly it.

        Raises:
            ConfigError: It is faster than tasks of the robot ask for, needs more force, torque or turn rate than it
                has, or leads the body into a volume to keep out of.
        """
        can, speed = robot.performance, self.target.speed
        if speed > can.speed:
            raise ConfigError(
                f"{what} moves by {speed:.3g} m/s, and tasks of '{robot.name}' ask for {can.speed:g} m/s at most: it "
                "would fall behind. Give a lower speed."
            )
        needs = self.target.acceleration()
        if needs > can.turning_acceleration:
            slower = speed * math.sqrt(can.turning_acceleration / needs)
            raise ConfigError(
                f"{what} bends so hard that {speed:.3g} m/s takes {needs:.3g} m/s², and '{robot.name}' sustains "
                f"{can.turning_acceleration:g} m/s². Give {slower:.2g} m/s at most, or a larger radius."
            )
        rate, change = self._turning()
        if rate > can.yaw_rate:
            raise ConfigError(
                f"{what} turns by {math.degrees(rate):.3g} deg/s, and tasks of '{robot.name}' ask for "
                f"{math.degrees(can.yaw_rate):.3g} deg/s at most. Give a lower speed, or a larger radius."
            )
        most = TURNING * can.torque / float(np.linalg.eigvalsh(robot.body.inertia_matrix)[-1])
        if change > most:
            raise ConfigError(
                f"{what} turns ever faster, by {math.degrees(change):.3g} deg/s², and the torque of '{robot.name}' "
                f"is for {math.degrees(most):.3g} deg/s². Give a lower speed, or a larger radius."
            )
        for volume in keep_outs:
            outside = float(volume.distance(self.table[:, :3]).min())
            if outside < robot.body.radius:
                raise ConfigError(
                    f"{what} comes to {outside:.2f} m from the keep-out volume (negative: within it), and "
                    f"'{robot.name}' has a radius of {robot.body.radius:g} m. Give a larger radius."
                )

    def _turning(self, step_s: float = 0.5) -> tuple[float, float]:
        """Largest turn rate [rad/s] and its largest change [rad/s²], from poses half a second apart."""
        times = np.arange(0.0, self.duration_s + step_s, step_s)
        quat = quat_of(at_rounds(self.table, self.rounds(times)))
        before, after = tuple(q[:-1] for q in quat), tuple(q[1:] for q in quat)
        rates = np.stack(logarithm(product(conjugate(before), after)), axis=-1) / step_s
        changes = np.linalg.norm(np.diff(rates, axis=0), axis=-1) / step_s
        fastest = float(angle_between(before, after).max()) / step_s
        return fastest, float(changes.max()) if len(changes) else 0.0


def of_one_sign(poses: np.ndarray) -> np.ndarray:
    """Poses along a path, shape (..., k, 7), whose quaternions nowhere jump to their negative."""
    after, before = poses[..., 1:, 3:], poses[..., :-1, 3:]
    flips = np.where(np.sum(after * before, axis=-1) < 0.0, -1.0, 1.0)
    if np.all(flips > 0.0):
        return poses
    found = np.array(poses)
    found[..., 1:, 3:] *= np.cumprod(flips, axis=-1)[..., None].astype(poses.dtype)
    return found


def at_rounds(table: np.ndarray, rounds: np.ndarray) -> np.ndarray:
    """Poses of a `Flight.table` after some rounds, shape (..., 7); of more than one the next begins."""
    share = np.where(rounds > 1.0, rounds % 1.0, rounds) * FINE
    before = np.minimum(share.astype(int), FINE - 1)
    part = (share - before)[..., None]
    return np.asarray((1.0 - part) * table[before] + part * table[before + 1])


def poses_along(
    flights: Sequence[Flight], which: np.ndarray, begin: np.ndarray, times: np.ndarray
) -> np.ndarray:
    """Poses that some worlds follow.

    Args:
        flights: Some, of one robot.
        which: Number of that of each world, shape (n,).
        begin: Share of a closed path at which each begins, shape (n,).
        times: Since then, shape (k,) [s].

    Returns:
        Shape (n, k, 7).
    """
    poses = np.empty((len(which), len(times), 7))
    for index, flight in enumerate(flights):
        mine = which == index
        poses[mine] = at_rounds(flight.table, begin[mine, None] * flight.closed + flight.rounds(times))
    poses[..., 3:] /= np.linalg.norm(poses[..., 3:], axis=-1, keepdims=True)
    return poses


@functools.lru_cache(maxsize=64)
def planned_flight(
    path: str, nearest: float, pace: Pace, *, facing: Facing, looks: Quat, can: Performance
) -> Flight:
    """The flight of a named path.

    Its speed is min(pace.speed, √(share · a · R)) with the acceleration a that the robot sustains and the radius R of
    the tightest bend; of a body that looks along it also no more than 0.9 of the turn rate there.

    Args:
        path: One of `named_paths.NAMED`.
        nearest: How near it comes to the origin [m].
        pace: How fast it is flown.
        facing: See `MovingTarget`; the point that it faces is the origin.
        looks: See `Flight`.
        can: Of the robot: speed, acceleration and turn rate.

    Raises:
        UnknownNameError: There is no such path.
    """
    curve = named_path(path, nearest)
    point = ORIGIN if facing == "point" else None

    def flown(speed: float, ease_s: float = 0.0) -> MovingTarget:
        return MovingTarget(curve, speed, facing, (0.0, 0.0, 0.0), 1, point, ease_s)

    bend = flown(1.0).acceleration()
    most = min(pace.speed, can.speed)
    if bend > 1e-9:
        most = min(most, math.sqrt(pace.share * can.turning_acceleration / bend))
        most = min(most, STEADY * can.yaw_rate / bend) if facing == "along_path" else most
    speed = pace.fixed or most
    return Flight(path, flown(speed, min(pace.ease_s, flown(speed).round_s)), looks)
