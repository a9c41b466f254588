"""Pushes and dead valves as network inputs in training: the truth, as late as the estimator would report it.

The estimator itself (`fulmar_core.estimators.actuator_health.actuator_estimator`) costs as much as the physics; it
is used wherever a network is evaluated or deployed.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.simulation import BatchSimulation

LEARNED = 0.35  # share of the unknown part of a push that one step reveals, the estimator's average [-]
ERROR = np.array([0.01, 0.01, 0.002])  # standard deviation of a known push [N, N, N·m]


class DisturbanceInputs:
    """Estimates of pushes and dead valves in a batch of worlds, shape (worlds, 3 + valves)."""

    def __init__(self, robot: Robot, *, worlds: int, seed: int) -> None:
        self._push = np.zeros((worlds, 3))  # in the world's frame
        self._dead = np.zeros((worlds, len(robot.actuators.names)), dtype=bool)
        self._rng = np.random.Generator(np.random.Philox(seed))

    def state(self) -> dict[str, Any]:
        """The mutable state, as values that pickle; for an exact resume."""
        return {"push": self._push.copy(), "dead": self._dead.copy(), "rng": self._rng.bit_generator.state}

    def set_state(self, state: dict[str, Any]) -> None:
        """Restore what `state` returned."""
        self._push, self._dead = state["push"].copy(), state["dead"].copy()
        self._rng.bit_generator.state = state["rng"]

    def reset(self, worlds: Any = slice(None)) -> None:
        """Begin anew in some worlds."""
        self._push[worlds], self._dead[worlds] = 0.0, False

    @property
    def dead(self) -> np.ndarray:
        """Which valves are known to be dead, shape (worlds, valves)."""
        return self._dead

    def learn(self, simulation: BatchSimulation) -> None:
        """Take a finished control step; a dead valve is noticed once it was commanded to open."""
        world = simulation.world
        push = np.stack((world.force_x, world.force_y, world.torque), axis=-1)
        self._push += LEARNED * (push - self._push)
        self._dead |= (simulation.command > 0.5) & (world.alive.T < 0.5)

    def inputs(self, simulation: BatchSimulation) -> np.ndarray:
        """Values to append to the next observation, shape (worlds, 3 + valves)."""
        push = self._push + ERROR * self._rng.standard_normal(self._push.shape)
        cos, sin = np.cos(simulation.measured.yaw), np.sin(simulation.measured.yaw)
        ahead = cos * push[:, 0] + sin * push[:, 1]
        left = cos * push[:, 1] - sin * push[:, 0]
        return np.column_stack((ahead, left, push[:, 2], ~self._dead)).astype(np.float32)
