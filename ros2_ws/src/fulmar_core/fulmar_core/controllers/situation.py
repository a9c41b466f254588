"""Where a platform is and what pushes it, put together from what a task shows and what was commanded."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fulmar_core.controllers.seen import Reader, Vector
from fulmar_core.health.applied import Applied
from fulmar_core.health.suspicion import Suspicion
from fulmar_core.health.thruster_health import Health, ThrusterHealth
from fulmar_core.health.valve_trials import ValveTrials
from fulmar_core.planar import PlanarState, wrapped
from fulmar_core.robot import Robot

UNSEEN = 1e3  # standard deviation of what is not measured at all, in any unit


@dataclass(frozen=True)
class Situation:
    """One moment of some robots, all in their bodies' own frames; shapes (...,) unless said."""

    goal: Vector  # way to the current target [m]
    turn: np.ndarray  # wanted heading minus heading, 0 where a task has none [rad]
    motion: tuple[np.ndarray, np.ndarray, np.ndarray]  # speed ahead, to the left [m/s], turn rate [rad/s]
    push: np.ndarray  # force and torque from outside, shape (..., 3) [N, N, N·m]
    alive: (
        np.ndarray | None
    )  # 1, or 0 for a valve not to be opened, shape (..., n); None where nothing is estimated


def raw_situation(reader: Reader, observation: np.ndarray) -> Situation:
    """What the observation says, and nothing else."""
    motion = reader.motion(observation)
    zero = np.zeros_like(motion[0])
    goal = (zero, zero) if reader.tracks else reader.goal(observation)
    turn = reader.turn(observation) if reader.heads else zero
    return Situation(goal, turn, motion, np.zeros((*zero.shape, 3)), None)


class Watch:
    """Observations through the estimator of the actuators' health.

    Its world has the target in its origin and the target's heading along its x axis. Where a target has no heading, is
    passed by, or is a velocity, no place stays: then only velocities are looked at, and the heading is what the turn
    rates add up to, which drifts slowly enough for a force to stay where it is.
    """

    def __init__(self, robot: Robot, reader: Reader, suspicion: Suspicion, dt: float) -> None:
        """Build the estimator for what the reader sees.

        Args:
            robot: A planar robot on air, with thrusters.
            reader: Of its observations.
            suspicion: How far to trust what.
            dt: Time between two observations, a multiple of the physics step [s].
        """
        self._reader, self._dt = reader, dt
        self._sees_pose = reader.heads and not (reader.tracks or reader.passes)
        place = suspicion.position if self._sees_pose else UNSEEN
        heading = suspicion.heading if self._sees_pose else UNSEEN
        self._estimator = ThrusterHealth(robot, replace(suspicion, position=place, heading=heading))
        self._trials = ValveTrials(suspicion.retry_s) if suspicion.retry_s else None
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._estimator.reset()
        if self._trials is not None:
            self._trials.reset()
        self._heading: np.ndarray | None = None  # at the last observation
        self._rate: np.ndarray = np.zeros(())  # turn rate, same
        self._applied: np.ndarray | Applied | None = None  # since the last observation
        self._passed_s = self._dt  # since then
        self.health: Health | None = None  # what is believed, in the world of this class

    def look(self, observation: np.ndarray) -> Situation:
        """Take an observation, shape (n,) or (rows, n); another number of rows than before begins anew."""
        reader, shape = self._reader, observation.shape[:-1]
        if self._heading is not None and self._heading.shape != shape:
            self.reset()
        raw = raw_situation(reader, observation)
        u, v, r = raw.motion
        yaw = -raw.turn
        if not self._sees_pose and self._heading is not None:
            yaw = self._heading + self._passed_s * self._rate
        (x, y), (vx, vy) = _turned(yaw, (-raw.goal[0], -raw.goal[1]), (u, v))
        health = self._estimator.see(PlanarState(x, y, yaw, vx, vy, r), self._applied, self._passed_s)
        self.health = health
        x, y, yaw, vx, vy, r = (health.motion[..., i] for i in range(6))
        self._heading, self._rate = yaw, r
        force = (health.push[..., 0], health.push[..., 1])
        goal, velocity, force = _turned(-yaw, (-x, -y), (vx, vy), force)
        turn = np.asarray(wrapped(-yaw))
        if not self._sees_pose:
            goal, turn = raw.goal, raw.turn
        push = health.push.copy()
        push[..., 0], push[..., 1] = force
        alive = health.alive
        if self._trials is not None:
            alive = self._trials.allowed(alive, self._opened(), self._passed_s)
        return Situation(goal, turn, (*velocity, r), push, alive)

    def _opened(self) -> np.ndarray | None:
        """What was open since the last observation; None where that is not known."""
        return self._applied.commands.max(axis=0) if isinstance(self._applied, Applied) else self._applied

    def acts(self, command: np.ndarray) -> None:
        """Take a command for what is applied until the next observation, unless `see_applied` corrects it, (..., n)."""
        self._applied, self._passed_s = command, self._dt

    def see_applied(self, applied: Applied | None) -> None:
        """Take what was applied since the last observation of one robot; None where that is not known."""
        self._applied, self._passed_s = applied, applied.duration_s if applied else self._dt


def _turned(angle: np.ndarray, *vectors: Vector) -> list[Vector]:
    """Vectors turned counterclockwise by one angle."""
    c, s = np.cos(angle), np.sin(angle)
    return [(c * x - s * y, s * x + c * y) for x, y in vectors]
