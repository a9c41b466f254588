"""Move with a wanted velocity and turn rate, which change now and then."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal

from array_api_compat import device

from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.planar import PlanarState, at_rest
from fulmar_core.states.rotation import Array
from fulmar_core.tasks.goal import Goal, no_obstacles
from fulmar_core.tasks.task import FileTask
from fulmar_core.tasks.terms import MOTION_TERMS, Errors, motion_terms

ERROR_TERMS = ("velocity_error_x_in_body", "velocity_error_y_in_body", "yaw_rate_error")
FINE_ERROR_TERMS = ("fine_velocity_error_x_in_body", "fine_velocity_error_y_in_body", "fine_yaw_rate_error")
STEP_S = 0.2  # between targets that turn [s]


@dataclass(frozen=True)
class VelocityReward:
    """Weights of the reward, per control step."""

    velocity: float  # times exp(-e / 0.1 m/s): RANS cfg/task/reward/*.yaml
    velocity_far: float  # times exp(-e / 0.5 m/s): RoboRAN tasks_cfg/track_velocities_cfg.py
    yaw_rate: float  # times exp(-|e| / 0.1 rad/s)
    yaw_rate_far: float  # times exp(-|e| / 0.5 rad/s): RoboRAN, same file
    joint: float  # times exp(-e / 0.1 m/s - |e| / 0.1 rad/s): asks for both at once
    fine: float = 0.0  # times exp(-e / 0.02 m/s): asks for a centimetre per second

    def of(self, xp: Any, e: Array, r: Array) -> Array:
        """Reward for the sizes of the errors of velocity [m/s] and turn rate [rad/s], shape (...,)."""
        return (
            self.velocity * xp.exp(-e / 0.1)
            + self.velocity_far * xp.exp(-e / 0.5)
            + self.yaw_rate * xp.exp(-r / 0.1)
            + self.yaw_rate_far * xp.exp(-r / 0.5)
            + self.joint * xp.exp(-e / 0.1 - r / 0.1)
            + self.fine * xp.exp(-e / 0.02)
        )


@dataclass(frozen=True)
class TrackVelocities(FileTask[PlanarState]):
    """Track a velocity in the body's frame; the target arrives on `goal_velocity`.

    Targets are drawn from what the robot can do: up to its speeds, and no faster a turn than its sideways acceleration
    sustains at that speed.
    """

    kind: Literal["track_velocities"]
    hold_s: float  # time of one target [s]
    fine_velocity: float  # where the magnified velocity error saturates [m/s]
    fine_yaw_rate: float  # same for the turn rate [rad/s]
    reward_weights: VelocityReward
    turning: float = 0.0  # how fast a target's direction turns at most, of robots that go sideways [rad/s]
    spin: float = 1.0  # largest turn rate of targets, as a share of the robot's [-]

    goal_topic: ClassVar[str] = "goal_velocity"
    observation_names: ClassVar[tuple[str, ...]] = (*ERROR_TERMS, *MOTION_TERMS, *FINE_ERROR_TERMS)

    @property
    def step_s(self) -> float:
        """Time from a target to the next one in the list [s]."""
        return STEP_S if self.turning else self.hold_s

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[PlanarState, Goal]:
        """Draw a start at rest, and as many targets as the episode has time for."""
        count = math.ceil(self.episode_s / self.hold_s)
        can = robot.performance
        ahead = draws.uniform(-can.reverse_speed, can.speed, count)
        left = draws.uniform(-can.lateral_speed, can.lateral_speed, count)
        turn = self.spin * draws.uniform(-can.yaw_rate, can.yaw_rate, count)
        yaw = draws.uniform(-math.pi, math.pi)
        xp = array_namespace(ahead)
        speed = xp.sqrt(ahead * ahead + left * left)
        fastest = can.turning_acceleration / clip(speed, 1e-6, None)
        targets = xp.stack((ahead, left, clip(turn, -fastest, fastest)), axis=-1)
        if self.turning:
            rate = self.turning if can.lateral_speed > 0.0 else 0.0  # others would have to turn with it
            targets = self._turned(targets, draws.uniform(-rate, rate, count))
        zero = xp.zeros_like(yaw)
        return at_rest(zero, zero, yaw), Goal(targets, zero, no_obstacles(draws.worlds))

    def _turned(self, targets: Array, rates: Array) -> Array:
        """Targets at every `STEP_S`, which turn at some rates [rad/s] while they hold, shape (worlds, steps, 3)."""
        xp = array_namespace(targets)
        steps = round(self.hold_s / STEP_S)
        angle = rates[..., None] * STEP_S * xp.arange(steps, dtype=targets.dtype, device=device(targets))
        c, s = xp.cos(angle), xp.sin(angle)
        u, v = targets[..., 0, None], targets[..., 1, None]
        turned = xp.stack((c * u - s * v, s * u + c * v, targets[..., 2, None] + 0.0 * c), axis=-1)
        return xp.reshape(turned, (targets.shape[0], -1, 3))

    def observe(self, state: PlanarState, goal: Goal) -> tuple[Array, ...]:
        """What every controller of this task sees; see `Task.observe`."""
        xp = array_namespace(state.x)
        u, v, r = motion_terms(state)
        target = goal.current
        eu, ev, er = target[..., 0] - u, target[..., 1] - v, target[..., 2] - r
        size = clip(xp.sqrt(eu * eu + ev * ev), self.fine_velocity, None)
        turn = clip(er / self.fine_yaw_rate, -1.0, 1.0)
        return eu, ev, er, u, v, r, eu / size, ev / size, turn

    def advance(self, goal: Goal, state: PlanarState, time_s: Array) -> Goal:
        """The next target comes when the time of this one is over."""
        return at_time(goal, time_s, self.step_s)

    def reward(self, before: PlanarState, after: PlanarState, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step; see `Task.reward`."""
        xp = array_namespace(after.x)
        w = self.reward_weights
        errors = self.errors(after, goal)
        return w.of(xp, errors.velocity, xp.abs(errors.yaw_rate))

    def errors(self, state: PlanarState, goal: Goal) -> Errors:
        """Length of the velocity error, and turn rate error."""
        xp = array_namespace(state.x)
        u, v, r = motion_terms(state)
        target = goal.current
        eu, ev = target[..., 0] - u, target[..., 1] - v
        return Errors(velocity=xp.sqrt(eu * eu + ev * ev), yaw_rate=target[..., 2] - r)


def at_time(goal: Goal, time_s: Array, step_s: float) -> Goal:
    """A goal whose targets follow each other by the clock, each after `step_s` [s]; one alone stays."""
    if goal.targets.shape[-2] == 1:
        return goal
    xp, last = array_namespace(goal.targets), goal.targets.shape[-2] - 1
    done = clip(xp.floor((time_s + 1e-6) / step_s), 0.0, float(last))
    return replace(goal, done=xp.zeros_like(goal.done) + xp.astype(done, goal.done.dtype))
