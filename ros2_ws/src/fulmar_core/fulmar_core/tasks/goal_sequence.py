"""Goal sequence: which goal of a goal file counts now, from the robot's state and the time."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, ClassVar, Protocol

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import State
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import Goal, goal_at
from fulmar_core.tasks.goal_files import FollowedPath, GoalFile, Poses, Positions, Trajectory, Velocities
from fulmar_core.tasks.references.look_ahead import LookAhead, Progress, body_target, steered_target
from fulmar_core.tasks.space_terms import place_errors
from fulmar_core.tasks.terms import Errors, Tolerance, pose_errors

_ERRORS: dict[type[State], Callable[[Any, Array], Errors]] = {
    PlanarState: partial(pose_errors, heading=True),
    SpatialState: partial(place_errors, attitude=True),
}
HOLD_S = 1.0  # within the tolerance for so long, a target is reached rather than passed


class GoalSequence(Protocol):
    """Goals that follow each other; `step` is called with each state until it is done."""

    topic: str  # where the goals belong, one of `topics.GOAL_WIRES`
    standstill: Goal  # of a robot that does not know where it is; the velocity 0 where goals are velocities

    @property
    def form(self) -> type[State]:
        """Of the states that it takes, and of its targets."""

    @property
    def done(self) -> bool:
        """Whether nothing further comes."""

    @property
    def progress(self) -> str:
        """How far it has come, for people."""

    @property
    def place(self) -> dict[str, int]:
        """How far it has come, for `go_on_at`; what goes by the clock alone has no place."""

    def go_on_at(self, place: Mapping[str, int]) -> None:
        """Go on where another one of the same file was."""

    def step(self, state: State, time_s: float) -> Goal:
        """Take a state.

        Args:
            state: Measured, without a batch axis.
            time_s: When, since the first one; never less than before [s].

        Returns:
            The goal that counts from now on, without a batch axis.
        """


class _ByClock:
    """What goes by the clock alone: it has no place."""

    place: ClassVar[dict[str, int]] = {}

    def go_on_at(self, place: Mapping[str, int]) -> None:
        """It goes by the clock."""


class Waypoints:
    """Positions or poses, each when the one before is reached, or all in one goal."""

    def __init__(
        self, topic: str, file: Positions | Poses, tolerance: Tolerance, *, hold_s: float, at_once: bool
    ) -> None:
        """Begin with the first.

        Args:
            topic: Where the goals belong.
            file: The targets.
            tolerance: Within which a target is reached; a heading or attitude of 0 does not count.
            hold_s: How long a robot must stay there [s].
            at_once: Whether the goal has all targets; it then is done after one round.
        """
        self.topic, self.form = topic, file.form
        targets = file.targets()
        self._goals = [_goal(*targets)] if at_once else [_goal(target) for target in targets]
        self.standstill = self._goals[0]
        self._targets, self._hold_s = targets, hold_s
        self._tolerance = dataclasses.replace(tolerance, velocity=0.0, yaw_rate_deg=0.0, rate_deg=0.0)
        self._reached = 0
        self._inside_since: float | None = None

    @property
    def done(self) -> bool:
        """Whether the last one is reached."""
        return self._reached == len(self._targets)

    @property
    def progress(self) -> str:
        """How many are reached."""
        return f"{self._reached} of {len(self._targets)} targets reached"

    @property
    def place(self) -> dict[str, int]:
        """How many are reached."""
        return {"reached": self._reached}

    def go_on_at(self, place: Mapping[str, int]) -> None:
        """Take so many as reached."""
        self._reached = min(max(0, place.get("reached", 0)), len(self._targets))

    def step(self, state: State, time_s: float) -> Goal:
        """The first target that is not reached, or all; see `GoalSequence.step`."""
        if not self.done:
            self._check(state, time_s)
        return self._goals[min(self._reached, len(self._goals) - 1)]

    def _check(self, state: State, time_s: float) -> None:
        if not self._is_inside(state, self._targets[self._reached]):
            self._inside_since = None
            return
        if self._inside_since is None:
            self._inside_since = time_s
        if time_s - self._inside_since >= self._hold_s:
            self._reached, self._inside_since = self._reached + 1, None

    def _is_inside(self, state: State, target: np.ndarray) -> bool:
        """Whether a state lies within the tolerance of a target."""
        return bool(self._tolerance.holds(_ERRORS[self.form](state, target)))


class Schedule(_ByClock):
    """Velocities by the clock, and standstill after the last."""

    topic = "goal_velocity"

    def __init__(self, file: Velocities) -> None:
        """Begin with the first."""
        self.form = file.form
        targets = file.targets()
        self._goals, self._ends = [_goal(velocity) for velocity in targets], file.ends()
        self.standstill = _goal(np.zeros_like(targets[0]))
        self._over = 0

    @property
    def done(self) -> bool:
        """Whether the time of the last one is over."""
        return self._over == len(self._ends)

    @property
    def progress(self) -> str:
        """How many are over."""
        return f"{self._over} of {len(self._ends)} velocities over"

    def step(self, state: State, time_s: float) -> Goal:
        """The velocity of this time; see `GoalSequence.step`."""
        # A microsecond early, for times that were added up.
        self._over = int(np.searchsorted(self._ends, time_s + 1e-6, side="right"))
        return self.standstill if self.done else self._goals[self._over]


class Following:
    """Velocities that lead along a path, and standstill at its end."""

    topic, form = "goal_velocity", PlanarState
    standstill = goal_at((0.0, 0.0, 0.0))

    def __init__(self, file: FollowedPath, *, sideways: bool) -> None:
        """Follow a path; `sideways`: the robot moves to any side without turning, others turn towards their aim."""
        self._file, self._sideways = file, sideways
        self._planner: LookAhead = file.planner()
        self._on_path: Progress | None = None
        self._begin = Progress()

    @property
    def done(self) -> bool:
        """Whether the path is at its end, or its rounds are."""
        return self._on_path is not None and self._planner.is_done(self._on_path)

    @property
    def progress(self) -> str:
        """How many rounds of a closed path are over, or whether an open one is."""
        if not self._planner.closed:
            return "the path is at its end" if self.done else "on the path"
        laps = 0 if self._on_path is None else self._on_path.laps
        return f"{laps} rounds" if self._planner.loops == 0 else f"{laps} of {self._planner.loops} rounds"

    @property
    def place(self) -> dict[str, int]:
        """Rounds, and of an open path the nearest point: a closed one is entered anew where it is nearest."""
        at = self._on_path or Progress()
        return {"laps": at.laps} if self._planner.closed else {"index": at.index, "laps": at.laps}

    def go_on_at(self, place: Mapping[str, int]) -> None:
        """Enter the path there."""
        index = min(max(0, place.get("index", 0)), len(self._planner.points) - 1)
        self._begin = Progress(index, max(0, place.get("laps", 0)))

    def step(self, state: State, time_s: float) -> Goal:
        """The velocity towards the aim; see `GoalSequence.step`."""
        assert isinstance(state, PlanarState)
        lead_s = self._file.lead_s
        position = np.array([float(state.x + lead_s * state.vx), float(state.y + lead_s * state.vy)])
        if self._on_path is None:
            self._on_path = self._enter(position)
        velocity, self._on_path = self._planner.aim(self._on_path, position)
        yaw = float(state.yaw)
        if self._sideways:
            return _goal(body_target(velocity, yaw))
        most = math.radians(self._file.max_yaw_rate_deg)
        return _goal(steered_target(velocity, yaw, gain=self._file.turn_gain, max_yaw_rate=most))

    def _enter(self, position: np.ndarray) -> Progress:
        """An open path is entered at its beginning, a closed one where it is nearest: its rounds begin there."""
        if self._planner.closed:
            points = np.roll(self._planner.points, -self._planner.nearest(position).index, axis=0)
            self._planner = dataclasses.replace(self._planner, points=points)
        return self._begin


class Moving(_ByClock):
    """A pose or a position that moves by the clock, and stands still at its end."""

    def __init__(self, file: Trajectory) -> None:
        """Begin where the file's path does."""
        self.topic = "goal_point" if file.facing == "any" else "goal_pose"
        self._target, self._time_s = file.target(), 0.0
        self.form = file.form
        self.standstill = _goal(self._target.pose(0.0))

    @property
    def done(self) -> bool:
        """Whether the target stands still."""
        return self._time_s >= self._target.duration_s

    @property
    def progress(self) -> str:
        """How many rounds of a closed path are over, or how much of an open one."""
        rounds = self._target.rounds(self._time_s)
        if not self._target.path.closed:
            return f"{math.floor(10.0 * rounds) * 10} % of the path"
        return f"{math.floor(rounds)} of {self._target.loops or 'endless'} rounds"

    def step(self, state: State, time_s: float) -> Goal:
        """The pose of this time; see `GoalSequence.step`."""
        self._time_s = time_s + 1e-6  # for times that were added up
        return _goal(self._target.pose(time_s))


def _goal(*targets: np.ndarray) -> Goal:
    return goal_at(*(tuple(target.tolist()) for target in targets))


def goal_sequence(goals: GoalFile, robot: Robot, *, as_path: bool = False) -> GoalSequence:
    """Goal sequence of a goal file for a robot, with the tolerances of the tasks that take such goals.

    Args:
        goals: The goal file.
        robot: The robot.
        as_path: Give all positions or poses at once, for tasks that pass through them.

    Raises:
        ConfigError: The goals are of the other space; `as_path` with velocities, or with a path that is followed by
            velocities.
    """
    if goals.form is not robot.state_type:
        raise ConfigError(
            f"'{goals.title}' is in {goals.form.WORLD}, and robot '{robot.name}' moves in {robot.state_type.WORLD}: a "
            f"pose is {','.join(robot.state_type.NUMBERS)} there."
        )
    if isinstance(goals, Positions | Poses):
        last = "positions" if isinstance(goals, Positions) else "poses"
        where = goals.form.SUFFIX
        if as_path:
            tolerance = load_task(f"go_through_{last}{where}").tolerance
            return Waypoints("goal_path", goals, tolerance, hold_s=0.0, at_once=True)
        tolerance = load_task(f"go_to_{last.removesuffix('s')}{where}").tolerance
        topic = "goal_point" if isinstance(goals, Positions) else "goal_pose"
        return Waypoints(topic, goals, tolerance, hold_s=HOLD_S, at_once=False)
    if as_path:
        raise ConfigError(
            f"'{goals.title}' has neither positions nor poses; only positions and poses can be a path."
        )
    if isinstance(goals, Velocities):
        return Schedule(goals)
    if isinstance(goals, Trajectory):
        return Moving(goals)
    return Following(goals, sideways=robot.actuators.sideways)
