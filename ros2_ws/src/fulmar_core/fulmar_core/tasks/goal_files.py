"""Goal files: `configs/goals/<name>.yaml`, distinguished by `kind`."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, cast

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_path
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import State
from fulmar_core.tasks.excitation import Torques
from fulmar_core.tasks.goal_words import any_attitude, place_words, pose_words
from fulmar_core.tasks.references import ReferencePath
from fulmar_core.tasks.references.in_space import Place, SpacePath
from fulmar_core.tasks.references.look_ahead import LookAhead, follow
from fulmar_core.tasks.references.moving_target import Facing, MovingTarget

_RADIANS = np.array([1.0, 1.0, np.pi / 180.0])  # of what is written as (length, length, degrees)
_RADIANS_IN_SPACE = np.array([1.0, 1.0, 1.0, *[np.pi / 180.0] * 3])


def _form_of(rows: Sequence[Sequence[float]], name: str, plane: int, space: int) -> type[State]:
    """State type of what has so many numbers in each row; the name is that of the key in the file.

    Raises:
        ValueError: There is no row, or one has another length than the first, or a length of neither.
    """
    if not rows:
        raise ValueError(f"'{name}' must have at least one entry.")
    lengths = {len(row) for row in rows}
    if lengths not in ({plane}, {space}):
        raise ValueError(
            f"every entry of '{name}' must have {plane} numbers, or {space} in space, all the same."
        )
    return PlanarState if lengths == {plane} else SpatialState


@dataclass(frozen=True)
class Positions:
    """Positions to visit in order."""

    kind: Literal["positions"]
    title: str
    positions: tuple[tuple[float, ...], ...]  # x, y, in space also z, in the world [m]

    def __post_init__(self) -> None:
        _form_of(self.positions, "positions", 2, 3)

    @property
    def form(self) -> type[State]:
        """State type of the robots and tasks that they are for."""
        return _form_of(self.positions, "positions", 2, 3)

    def targets(self) -> np.ndarray:
        """Targets as in `fulmar_core.tasks.goal.Goal`, shape (n, 3 or 7); their attitude is 0 and does not matter."""
        return np.array([self.form.target_at(place) for place in self.positions])


@dataclass(frozen=True)
class Poses:
    """Poses to take in order."""

    kind: Literal["poses"]
    title: str
    # x, y, heading in the world [m, m, deg]; in space x, y, z [m], roll, pitch, yaw [deg]
    poses: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        _form_of(self.poses, "poses", 3, 6)

    @property
    def form(self) -> type[State]:
        """State type of the robots and tasks that they are for."""
        return _form_of(self.poses, "poses", 3, 6)

    def targets(self) -> np.ndarray:
        """Targets as in `fulmar_core.tasks.goal.Goal`, shape (n, 3 or 7)."""
        if self.form is PlanarState:
            return np.asarray(np.array(self.poses) * _RADIANS)
        return np.array([self.form.target_at(pose) for pose in self.poses])


@dataclass(frozen=True)
class HeldVelocity:
    """One velocity for some time."""

    # ahead, to the left, turning, in the body frame [m/s, m/s, deg/s]; in space three of each [m/s, deg/s]
    velocity: tuple[float, ...]
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
        _form_of([held.velocity for held in self.velocities], "velocities", 3, 6)

    @property
    def form(self) -> type[State]:
        """State type of the robots and tasks that they are for."""
        return _form_of([held.velocity for held in self.velocities], "velocities", 3, 6)

    def targets(self) -> np.ndarray:
        """Velocities in the body frame, shape (n, 3) [m/s, m/s, rad/s]; in space (n, 6) [m/s, rad/s]."""
        radians = _RADIANS if self.form is PlanarState else _RADIANS_IN_SPACE
        return np.asarray(np.array([held.velocity for held in self.velocities]) * radians)

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

    @property
    def form(self) -> type[State]:
        """Paths lie in the plane."""
        return PlanarState

    def planner(self) -> LookAhead:
        """What aims along the path."""
        return follow(self.path, speed=self.speed, look_ahead=self.look_ahead, loops=self.loops)


@dataclass(frozen=True)
class Trajectory:
    """A target that moves along a path in space, from the first odometry on."""

    kind: Literal["trajectory"]
    title: str
    path: SpacePath
    speed: float  # [m/s]
    # Of the body's x axis: along the path, with z nearest to the path's own up; at a `point`, without rolling; `fixed`
    # as `angles_deg`; or `any`, of goals that are positions.
    facing: Facing = "along_path"
    point: Place | None = None  # x, y, z of `point`; the path's centre by default [m]
    angles_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)  # roll, pitch, yaw of `fixed` [deg]
    loops: int = 1  # rounds of a closed path; 0 means for ever
    ease_s: float = 0.0  # in which it gets up to its speed, and to rest at the end; 0: at once [s]

    def __post_init__(self) -> None:
        if self.speed <= 0.0:
            raise ValueError("'speed' must be greater than 0.")
        if self.loops < 0 or self.ease_s < 0.0:
            raise ValueError("'loops' and 'ease_s' must not be negative; 0 loops mean for ever.")
        if any(self.angles_deg) and self.facing != "fixed":
            raise ValueError(f"'angles_deg' needs facing: fixed, found facing: {self.facing}.")
        if self.point is not None and self.facing != "point":
            raise ValueError(f"'point' needs facing: point, found facing: {self.facing}.")
        target = self.target()
        if self.ease_s > target.duration_s - self.ease_s:
            raise ValueError(
                f"'ease_s' = {self.ease_s:g} s is longer than the path, of {target.duration_s - self.ease_s:.3g} s."
            )
        target.pose(0.0)

    @property
    def form(self) -> type[State]:
        """Such paths lie in space."""
        return SpatialState

    def target(self) -> MovingTarget:
        """What moves."""
        return self._target

    @functools.cached_property
    def _target(self) -> MovingTarget:
        return MovingTarget(
            self.path, self.speed, self.facing, self.angles_deg, self.loops, self.point, self.ease_s
        )

    def targets(self) -> np.ndarray:
        """The pose that it begins with, shape (1, 7)."""
        return self.target().pose(0.0)[None]


GoalFile = Positions | Poses | Velocities | FollowedPath | Trajectory


def single_goal(place: tuple[float, ...], form: type[State] = PlanarState) -> Positions | Poses:
    """One place, as a goal file would hold it.

    Args:
        place: As `form` writes places and poses; without angles it is a position [m, deg].
        form: State type of the robot.
    """
    axes, angles = place[: form.AXES], place[form.AXES :]
    if not angles:
        return Positions("positions", f"{place_words(form, place)}, {any_attitude(form)}", (axes,))
    return Poses("poses", pose_words(form, place), (place,))


def load_goal_file(name: str) -> GoalFile | Torques:
    """Read `configs/goals/<name>.yaml`, or a file anywhere whose path ends in `.yaml`.

    Raises:
        ConfigError: Unknown name, or a mistake in the file.
    """
    return cast(GoalFile | Torques, load_config(GoalFile | Torques, goal_file_path(name)))  # type: ignore[arg-type]


def goal_file_path(name: str) -> Path:
    """Where the goals of a name are; argument as in `load_goal_file`.

    Raises:
        ConfigError: Unknown name.
    """
    return Path(name) if name.endswith(".yaml") else config_path("goals", name)


def load_goals(name: str) -> GoalFile:
    """Read a file of goals; argument and errors as in `load_goal_file`, and torques are none."""
    file = load_goal_file(name)
    if isinstance(file, Torques):
        raise ConfigError(
            f"the goals '{name}' are torques, which a controller plays: "
            f"fulmar run cubesat_wheels --controller excite --goals {name}"
        )
    return file


def load_torques(name: str) -> Torques:
    """Read a file of torques; argument and errors as in `load_goal_file`, and goals are none."""
    file = load_goal_file(name)
    if not isinstance(file, Torques):
        raise ConfigError(f"the goals '{name}' are no torques: their file says 'kind: {file.kind}'.")
    return file
