"""Trajectories of episodes, step by step, and the counter of their targets."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.dynamics.things import Poses
from fulmar_core.robots.robot import Robot
from fulmar_core.states.state import State
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import Goal, stack_goals


@dataclass(frozen=True)
class Trajectories:
    """What happened after each control step of some episodes of equal length; NaN where a task does not ask."""

    x: np.ndarray  # (episodes, steps) [m]
    y: np.ndarray  # (episodes, steps) [m]
    yaw: np.ndarray  # (episodes, steps) any multiple of a turn added [rad]
    position_error: np.ndarray  # (episodes, steps) [m]
    heading_error: np.ndarray  # (episodes, steps) [rad]
    velocity_error: np.ndarray  # (episodes, steps) [m/s]
    yaw_rate_error: np.ndarray  # (episodes, steps) [rad/s]
    speed: np.ndarray  # (episodes, steps) [m/s]
    yaw_rate: np.ndarray  # (episodes, steps) about the vertical; in space the length of the turn rate [rad/s]
    shares: np.ndarray  # (episodes, steps, actuators) command as a share of the largest one, signed [-]
    goals: np.ndarray  # (episodes, steps) targets reached, or over, so far
    touching: np.ndarray  # (episodes, steps) whether the robot is at an obstacle
    outside: np.ndarray  # (episodes, steps) whether it is beyond the geofence
    control_dt: float  # [s]
    # In space alone:
    z: np.ndarray | None = None  # (episodes, steps) [m]
    attitude_error: np.ndarray | None = None  # (episodes, steps) [rad]
    rate_error: np.ndarray | None = None  # (episodes, steps) [rad/s]
    # Of robots whose fuel is a part of their body alone:
    thrust: np.ndarray | None = None  # (episodes, steps) of all nozzles at the regulated pressure [N]
    exhaust_speed: float = 0.0  # impulse of a kilogram of fuel [m/s]
    # Beside a thing in space alone:
    keep_out_distance: np.ndarray | None = None  # (episodes, steps) outside of volumes to keep out of [m]
    pointing_error: np.ndarray | None = None  # (episodes, steps) of the camera's axis [rad]
    qx: np.ndarray | None = None  # (episodes, steps) attitude, with the next three
    qy: np.ndarray | None = None
    qz: np.ndarray | None = None
    qw: np.ndarray | None = None

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the arrays that it has."""
        return tuple(name for name in COLUMNS if getattr(self, name) is not None)

    def mapped(self, change: Callable[[np.ndarray], np.ndarray]) -> Trajectories:
        """The same with every array changed."""
        arrays: dict[str, Any] = {name: change(getattr(self, name)) for name in self.columns}
        return dataclasses.replace(self, **arrays)

    @property
    def actuators_in_use(self) -> np.ndarray:
        """Share of actuators with a command other than zero, shape (episodes, steps) [-]."""
        return np.asarray(np.mean(self.shares != 0.0, axis=-1))

    @property
    def effort(self) -> np.ndarray:
        """Mean share of full command, shape (episodes, steps) [-]."""
        return np.asarray(np.mean(np.abs(self.shares), axis=-1))

    @property
    def variation(self) -> np.ndarray:
        """Sum over the actuators of how much their share changed, from rest on, shape (episodes, steps) [-]."""
        before = np.concatenate((np.zeros_like(self.shares[:, :1]), self.shares[:, :-1]), axis=1)
        return np.asarray(np.sum(np.abs(self.shares - before), axis=-1))


COLUMNS = tuple(
    field.name
    for field in dataclasses.fields(Trajectories)
    if field.name not in ("control_dt", "exhaust_speed")
)
IN_SPACE = ("z", "attitude_error", "rate_error")  # columns that robots in the plane have not
OF_FUEL = ("thrust",)  # columns that robots without fuel in their mass have not
BESIDE = (
    "keep_out_distance",
    "pointing_error",
    "qx",
    "qy",
    "qz",
    "qw",
)  # that are known beside a thing in space


class TrajectoryLog:
    """Collects steps of one episode or of a batch, as float32: thousands of episodes fit into memory."""

    def __init__(self, robot: Robot, task: Task, control_dt: float) -> None:
        """Begin empty; `control_dt` in seconds."""
        self._robot, self._task, self._control_dt = robot, task, control_dt
        tank = robot.actuators.tank
        self._exhaust_speed = tank.exhaust_speed if tank is not None and tank.weighs else 0.0
        left_out = (
            *(() if "z" in task.state_type.COLUMNS else IN_SPACE),
            *(() if self._exhaust_speed else OF_FUEL),
            *(() if task.keep_outs else BESIDE),
        )
        self._names = tuple(name for name in COLUMNS if name not in left_out)
        self._columns: dict[str, list[np.ndarray]] = {name: [] for name in self._names}

    def add(self, truth: State, goal: Goal, command: np.ndarray) -> None:
        """Note one control step.

        Args:
            truth: True state after the step, shapes () or (episodes,).
            goal: Goal of a `TargetCounter` at that time, same leading shape.
            command: What was applied, shape (n,) or (episodes, n).
        """
        for name, kept in self._kept(truth, goal, command):
            self._columns[name].append(kept)

    def add_episode(self, truths: Sequence[State], goals: list[Goal], commands: list[np.ndarray]) -> None:
        """Note all control steps of one episode at once, which costs little more than one of them.

        Args:
            truths: True states after the steps, each of shape ().
            goals: Goals of a `TargetCounter` then, same.
            commands: What was applied in each, shapes (n,).
        """
        each = [goals[0]] if all(goal is goals[0] for goal in goals) else goals
        counted = stack_goals(each)[np.zeros(len(goals), dtype=int)] if len(each) == 1 else stack_goals(each)
        for name, kept in self._kept(self._task.state_type.stack(truths), counted, np.stack(commands)):
            self._columns[name].extend(kept)

    def _kept(self, state: State, goal: Goal, command: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
        values = _step_columns(self._robot, self._task, state, goal)
        values["shares"] = np.asarray(command) / self._robot.actuators.scale
        if self._exhaust_speed:
            values["thrust"] = self._robot.actuators.total_thrust(np.asarray(command).T)
        for name in self._names:
            value = np.asarray(values[name])
            shape = value.shape if name == "shares" else np.shape(state.like)
            kept = np.empty(shape, bool if value.dtype == bool else np.float32)
            kept[...] = value
            yield name, kept

    def trajectories(self) -> Trajectories:
        """Everything noted so far; the log is empty afterwards."""
        arrays = {}
        for name in self._names:
            steps = np.stack(self._columns.pop(name), axis=-2 if name == "shares" else -1)
            arrays[name] = steps[None] if steps.ndim == (2 if name == "shares" else 1) else steps
        self._columns = {name: [] for name in self._names}
        return Trajectories(**arrays, control_dt=self._control_dt, exhaust_speed=self._exhaust_speed)


def _step_columns(robot: Robot, task: Task, state: State, goal: Goal) -> dict[str, np.ndarray]:
    errors, touching = task.errors(state, goal), task.collides(state, goal, robot)
    unasked, none = np.asarray(np.nan), np.asarray(False)
    away = task.distance_from_goal(state, goal)
    far = none if away is None else np.asarray(away > robot.limits.geofence)
    return {
        **(_beside(robot, task, state) if task.keep_outs else {}),
        **state.logged(),
        "position_error": unasked if errors.position is None else errors.position,
        "heading_error": unasked if errors.heading is None else errors.heading,
        "velocity_error": unasked if errors.velocity is None else errors.velocity,
        "yaw_rate_error": unasked if errors.yaw_rate is None else errors.yaw_rate,
        "attitude_error": unasked if errors.attitude is None else errors.attitude,
        "rate_error": unasked if errors.rate is None else errors.rate,
        "goals": goal.done,
        "touching": none if touching is None else touching,
        "outside": far,
    }


def _beside(robot: Robot, task: Task, state: State) -> dict[str, np.ndarray]:
    """Columns of `BESIDE`."""
    x, y, z, *quat = state.columns()[:7]
    place = np.stack((x, y, z), axis=-1)
    pointing = task.pointing_error(state, robot)
    return {
        "keep_out_distance": np.min([volume.distance(place) for volume in task.keep_outs], axis=0),
        "pointing_error": np.asarray(np.nan) if pointing is None else pointing,
        **dict(zip(BESIDE[2:], quat, strict=True)),
    }


class TargetCounter:
    """Counts reached targets by the task's own tolerance, whatever the controller takes for reached."""

    def __init__(self, task: Task, goal: Goal, control_dt: float) -> None:
        self._task, self._dt, self._steps = task.evaluated, control_dt, 0
        self.goal = goal

    def update(self, truth: State, things: Poses | None = None) -> Goal:
        """The goal after one more control step, by the true state at its end.

        Args:
            truth: True state.
            things: Where the task's things are by now, of the same leading shape.
        """
        self._steps += 1
        time_s = np.asarray(self._steps * self._dt)
        self.goal = self._task.counted(self.goal.among(things or {}), truth, time_s)
        return self.goal


def join(runs: list[Trajectories]) -> Trajectories:
    """One set of trajectories out of several of equal length and rate."""
    if len(runs) == 1:
        return runs[0]
    arrays: dict[str, Any] = {
        name: np.concatenate([getattr(run, name) for run in runs]) for name in runs[0].columns
    }
    return dataclasses.replace(runs[0], **arrays)


def select(run: Trajectories, episodes: np.ndarray) -> Trajectories:
    """Some episodes of a set, in the order of their indices."""
    return run.mapped(lambda array: array[episodes])


def first_steps(run: Trajectories, steps: int) -> Trajectories:
    """The beginning of every episode: so many control steps, or all there are."""
    return run.mapped(lambda array: array[:, :steps])
