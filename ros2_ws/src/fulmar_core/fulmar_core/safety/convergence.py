"""Detects a robot that commands with authority and comes no nearer to its goal."""

from __future__ import annotations

import functools
import math
from collections import deque
from dataclasses import replace

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.estimators.actuator_health.applied import AppliedHistory
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.by_kind import EFFORTS
from fulmar_core.states.rotation import Array
from fulmar_core.states.state import State
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import Goal
from fulmar_core.tasks.terms import Errors

LEAST_S = 6.0  # without progress, however near the goal [s]
LEAST_PERIODS = 20  # same, in control periods
PATIENCE = 3.0  # least times to the goal that are given [-]
HALF_TURNS = 2.0  # that a robot is given which cannot go sideways [-]
PROGRESS = 0.02  # share of the least time by which it must fall to count [-]
UNCONVERGED = "does not converge"
MAY_BE = "An actuator may have failed, or something holds or pushes it."
ALIKE = 0.1  # difference of a command and what was applied up to which they count as the same, in full commands [-]
OWN = 5  # commands of one's own that may be what was applied last: links delay them


class TimeToGoal:
    """Estimates the least time in which a robot that works as modelled reaches its target."""

    def __init__(self, robot: Robot, task: Task) -> None:
        """Derive speeds and accelerations from the robot's performance."""
        best = robot.performance
        inertia = max(robot.body.inertia[:3]) if not robot.body.planar else robot.body.inertia[2]
        effort = EFFORTS[robot.kind.name]
        self._push, self._slack = effort.acceleration(robot), effort.slack
        self._thrust = best.force / robot.body.mass
        self._speed = effort.speed * best.speed
        self._turn, self._yaw_rate = best.torque / inertia, best.yaw_rate
        limits = task.tolerance
        self._limits = Errors(
            limits.position,
            math.radians(limits.heading_deg),
            limits.velocity,
            math.radians(limits.yaw_rate_deg),
            math.radians(limits.attitude_deg),
            math.radians(limits.rate_deg),
        )

    def of(self, errors: Errors) -> np.ndarray:
        """Least time to bring every error that the task's tolerance limits to 0, shape (...,) [s]."""
        limits = self._limits
        parts = [
            self._way(errors.position, self._speed, self._push) if limits.position else None,
            self._way(errors.heading, self._yaw_rate, self._turn) if limits.heading else None,
            self._way(errors.attitude, self._yaw_rate, self._turn) if limits.attitude else None,
            np.abs(errors.velocity) / self._thrust if limits.velocity else None,
            np.abs(errors.yaw_rate) / self._turn if limits.yaw_rate else None,
            np.abs(errors.rate) / self._turn if limits.rate else None,
        ]
        return np.asarray(functools.reduce(np.maximum, [part for part in parts if part is not None]))

    @functools.cached_property
    def at_tolerance(self) -> float:
        """Of errors of so many tolerances that they are no reason to stop [s]."""
        names = Errors.__slots__
        return float(
            self.of(Errors(*(np.asarray(self._slack * getattr(self._limits, name)) for name in names)))
        )

    @staticmethod
    def _way(way: Array, speed: float, acceleration: float) -> np.ndarray:
        """Time for a distance or an angle from rest to rest."""
        size = np.abs(np.asarray(way, dtype=float))
        return np.asarray(np.maximum(size / speed, 2.0 * np.sqrt(size / acceleration)))


class ConvergenceMonitor:
    """Watches robots side by side, one control step after another.

    The least time to the goal has to fall while a robot commands with authority. The motion of a target itself is not
    counted, and each new target begins anew.

    Attributes:
        late_s: How long each has commanded without progress, and what it lost meanwhile, shape (n,) [s].
        patience_s: How long each may, shape (n,) [s].
    """

    def __init__(self, robot: Robot, task: Task, control_dt: float) -> None:
        """Watch robots whose control step is `control_dt` [s]."""
        self._task, self._dt = task, control_dt
        self._time = TimeToGoal(robot, task)
        self._scale = np.where(robot.actuators.scale > 0.0, robot.actuators.scale, 1.0)
        self._enough = EFFORTS[robot.kind.name].authority
        self._counted = slice(robot.actuators.positions or None)  # of an aircraft its surfaces
        turns = robot.body.planar and not robot.actuators.sideways
        half_turn = np.pi / robot.performance.yaw_rate if turns else 0.0
        self._least_s = max(LEAST_S, LEAST_PERIODS * control_dt) + HALF_TURNS * half_turn
        self.reset()

    def reset(self) -> None:
        """Begin anew: another goal, another controller, or time has passed without it."""
        self._goal: Goal | None = None
        self._before = np.zeros(1)
        self.late_s = self.patience_s = np.zeros(1)

    def see(self, state: State, goal: Goal, command: np.ndarray) -> np.ndarray:
        """Take a control step.

        Args:
            state: Measured, shapes (n,).
            goal: That counts now, shapes (n, ...).
            command: That answers it, shape (n, m).

        Returns:
            Which robots do not converge, shape (n,).
        """
        now = self._time.of(self._task.errors(state, goal))
        if self._goal is None:
            self._best = self._anchor = now
            self._waited, self._tries = np.zeros_like(now), np.zeros(now.shape, dtype=bool)
            reached = self._tries
        else:
            reached = goal.done != self._goal.done
            shift = self._shift(state, goal, now)
            self._best = self._best + np.where(self._tries, shift, now - self._before)
            self._waited = self._waited + self._dt * self._tries
        settled = now <= self._time.at_tolerance
        progress = reached | settled | (now < (1.0 - PROGRESS) * self._best)
        self._best = np.where(progress, now, self._best)
        self._anchor = np.where(progress, now, self._anchor)
        self._waited = np.where(progress, 0.0, self._waited)
        self._goal, self._before = goal, now
        share = np.abs(command / self._scale)[..., self._counted].max(axis=-1)
        self._tries = share >= self._enough
        self.late_s = self._waited + np.maximum(now - self._best, 0.0)
        self.patience_s = self._least_s + PATIENCE * self._anchor
        return np.asarray(self.late_s > self.patience_s)

    def _shift(self, state: State, goal: Goal, now: np.ndarray) -> np.ndarray | float:
        """What the target's own motion since the last step adds to the time to it [s]."""
        assert self._goal is not None
        if goal is self._goal or np.array_equal(self._goal.current, goal.current):
            return 0.0
        stood = replace(self._goal, things=goal.things)
        return np.asarray(now - self._time.of(self._task.errors(state, stood)))


class ConvergenceWatch:
    """Watches the one robot of a guarded loop while its controller alone moves it.

    Attributes:
        problem: How it does not converge, in words; empty while it does.
        dead: Which actuators are believed dead, in words; empty for none.
        hopeless: Whether no pose can be held without these.
    """

    def __init__(self, robot: Robot, task: Task, control_dt: float, applied: AppliedHistory | None) -> None:
        """Watch a robot.

        Args:
            robot: The robot.
            task: What it does.
            control_dt: Control step [s].
            applied: What its actuators did, as far as it is known; None: its commands.
        """
        self._monitor, self._applied = ConvergenceMonitor(robot, task, control_dt), applied
        self._alike = ALIKE * robot.actuators.scale
        self._own: deque[np.ndarray] = deque(maxlen=OWN)
        self.problem = self.dead = ""
        self.hopeless = False
        limits = task.tolerance
        self._wants_pose = bool(limits.position) and bool(limits.heading_deg or limits.attitude_deg)

    def reset(self) -> None:
        """Begin anew; see `ConvergenceMonitor.reset`."""
        self._monitor.reset()
        self._own.clear()
        self.problem = ""

    def see(self, inputs: Inputs, command: np.ndarray) -> None:
        """Take a control step: what was observed, and the command that answers it, shape (1, m)."""
        if self._is_moved_by_others(inputs, command[0]):
            self.reset()
        self._own.append(command[0])
        late = bool(self._monitor.see(inputs.state, inputs.goal, command)[0])
        if self.hopeless and self._wants_pose:
            self.problem = (
                f"{UNCONVERGED}: the {self.dead}, and no pose can be held without it. Repair it, then give a new "
                "goal."
            )
        elif late:
            late_s = float(self._monitor.late_s[0])
            cause = f"The {self.dead}." if self.dead else MAY_BE
            self.problem = (
                f"{UNCONVERGED}: {late_s:.0f} s of commands have brought the robot no nearer to its goal. {cause} "
                "Look at it, then give a new goal."
            )

    def _is_moved_by_others(self, inputs: Inputs, command: np.ndarray) -> bool:
        """Whether a person, a watchdog or a hand had the robot since the last step; `command` may be in effect."""
        if inputs.estimates is not None and bool(inputs.estimates.health.held[0]):
            return True
        newest = self._applied.newest if self._applied is not None else None
        if newest is None or not self._own:
            return False
        return not any((np.abs(newest - own) <= self._alike).all() for own in (command, *reversed(self._own)))
