"""The core's own dynamics as a backend: every launch works without a simulator installed."""

from __future__ import annotations

import numpy as np

from fulmar_core.backend import Sample
from fulmar_core.disturbances.scenario import World
from fulmar_core.dynamics.rigid_body import Disturbance, MassProperties, step
from fulmar_core.robot import Robot
from fulmar_core.state import RigidBodyState, planar_state


class MockBackend:
    """One robot in the core's dynamics, measured without noise, without an inertial unit."""

    def __init__(self, robot: Robot) -> None:
        """Begin at rest at the origin with the nominal body."""
        self.robot = robot
        self._state = planar_state(0.0, 0.0, 0.0)
        self._body = MassProperties(np.array([robot.body.mass]), np.array(robot.body.inertia))
        self._disturbance = Disturbance(np.zeros(3), np.zeros(3))

    def reset(self, start: RigidBodyState, world: World, *, seed: int, number: int = 0) -> Sample:
        """Begin anew; see `Backend.reset`. Nothing here is random."""
        self._state = start
        self._body = MassProperties(np.array([world.mass]), np.array(world.inertia))
        self._disturbance = Disturbance(np.array(world.force_in_world), np.array(world.torque_in_world))
        return Sample(self._state, None, self._state)

    def step(self, command: np.ndarray, ticks: int = 1) -> Sample:
        """Apply a command; see `Backend.step`."""
        force, torque = self.robot.actuators.wrench_in_body(np.asarray(command, dtype=float))
        self._state = step(
            self._state,
            force,
            torque,
            body=self._body,
            disturbance=self._disturbance,
            planar=self.robot.body.planar,
            dt=self.robot.timing.physics_dt,
            substeps=ticks,
        )
        return Sample(self._state, None, self._state)

    def make_safe(self) -> None:
        """Nothing to do: a command acts only during a step."""

    def close(self) -> None:
        """Nothing to release."""
