"""Actuators, disturbances and sensors of one episode: the core's code on a batch of one.

Every simulator thus has the failures, noise, delays, pushes and sensors of the core's batch.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fulmar_core.dynamics.by_kind import actuation_of, dynamics_of
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.episode import Episode
from fulmar_core.simulation.simulation import ACTUATOR_NOISE
from fulmar_core.states.counter_rng import uniform_from, words, world_keys
from fulmar_core.states.state import RigidBodyState


class OneWorld:
    """Actuators, surroundings and odometry of one episode after another.

    Attributes:
        world: What was drawn for the episode, as a batch of one.
        actuation: What the actuators do.
        dynamics: Of the robot.
        extra: A push beside it, along the world's axes [N]; None: none.
        latest_s: How late commands act [s].
    """

    def __init__(self, robot: Robot, *, noisy: bool) -> None:
        self._robot, self._noisy = robot, noisy
        self.dynamics = dynamics_of(robot)
        self._safe = np.array(robot.actuators.safe_command)[:, None]

    def reset(self, episode: Episode, truth: RigidBodyState, *, seed: int, number: int) -> RigidBodyState:
        """Begin anew, and measure; arguments as in `begin_episode` and `first_measurement`."""
        self.begin_episode(episode)
        return self.first_measurement(truth, seed=seed, number=number)

    def begin_episode(self, episode: Episode) -> None:
        """Take the world of an episode, without a batch axis; actuators begin as its start has them."""
        self.world = episode.world.mapped(lambda part: np.asarray(part, dtype=float)[..., None])
        command = self._safe if episode.command is None else np.asarray(episode.command, dtype=float)[:, None]
        response = self._robot.actuators.response
        opening_s = float(response.opening_delay_s + self.world.opening_delay[0])
        self.latest_s = float(response.delay_s + self.world.action_delay[0]) + opening_s
        self.actuation = actuation_of(
            self._robot,
            command * self.world.alive,
            opens_late=opening_s > 0.0,
            latest_s=self.latest_s,
            step_s=self._robot.timing.physics_dt,  # in real time a command may come at every tick
            changes=bool(self.world.stuck_part[0] >= 0.0 or self.world.supply_left[0] < 1.0),
            world=self.world,
        )
        self._outside: Any = None  # before the first command
        self.extra: tuple[float, ...] | None = None
        self._constant_push = self.dynamics.push_is_constant(self.world)
        self._blurred = self.dynamics.blurs(self.world)

    def first_measurement(self, truth: RigidBodyState, *, seed: int, number: int) -> RigidBodyState:
        """Measure for the first time.

        Args:
            truth: Where the robot is.
            seed: Of the noise.
            number: Of the episode.
        """
        self._seed, self._numbers, self._repeats = seed, np.array([number]), np.array([0])
        self._ticks = 0
        self._begun = 0  # control steps
        self._left = 0  # ticks until the next one begins at the latest
        self._command: np.ndarray | None = None
        self._measured = 0
        self._first = truth
        self._start_odometer(self._robot.timing.substeps(self._robot.timing.control_hz))
        return self._measure(truth)

    def begin(
        self, command: np.ndarray, ticks: int, truth: RigidBodyState, *, begins: int | None = None
    ) -> None:
        """Take a command for some physics ticks.

        Several ticks are a control step of their own. With one tick at a time, a control step begins with each new
        command, and, unless `begins` says where, with an old one after the robot's own control period.

        Args:
            command: Within the actuators' limits, shape (n,).
            ticks: >= 1.
            truth: Where the robot is.
            begins: As in `Backend.step`.
        """
        nominal = begins or self._robot.timing.substeps(self._robot.timing.control_hz)
        if self._measured == 1 and ticks != self._period:
            self._start_odometer(ticks)
            self._measured = 0
            self._measure(self._first)
        changed = self._command is None or not np.array_equal(command, self._command)
        due = self._left <= 0 if begins is None else begins > 0
        if ticks > 1 or changed or due:
            self._command = np.array(command, dtype=float)
            self.actuation.begin(self._command[:, None], self.world, self._noise())
            if not (self._constant_push and self._begun):
                self._outside = self._push(truth, ticks if ticks > 1 else nominal)
            self._begun += 1
            self._left = nominal
        self._left -= ticks
        self._ticks += ticks

    @property
    def outside(self) -> Any:
        """Push of the surroundings in this control step, as in `Dynamics.outside`, shapes (1,)."""
        if self.extra is None:
            return self._outside
        along = len(self.extra)
        pushed = tuple(part + more for part, more in zip(self._outside, self.extra, strict=False))
        return (*pushed, *self._outside[along:])

    def measure(self, truth: RigidBodyState) -> RigidBodyState:
        """What the odometry reports now; called once for each `begin`, at its end."""
        return self._measure(truth)

    def _push(self, truth: RigidBodyState, ticks: int) -> Any:
        dt, state = self._robot.timing.physics_dt, self.dynamics.state_type.from_rigid(truth)
        return self.dynamics.outside(state[None], self.world, np.array([self._ticks * dt]), ticks * dt)

    def _noise(self) -> np.ndarray | None:
        if not self.world.action_noise[0]:
            return None
        keys = world_keys(self._seed, self._numbers, self._repeats, ACTUATOR_NOISE)
        bits = words(keys, np.array([self._begun]), len(self._safe))
        return 2.0 * uniform_from(bits, np.float64) - 1.0

    def _start_odometer(self, ticks: int) -> None:
        self._period = ticks
        self._odometer = self.dynamics.odometer(
            self._robot.sensors.odometry,
            seed=self._seed,
            period=ticks * self._robot.timing.physics_dt,
            max_delay_s=float(self.world.sensor_delay[0]),
            noisy=self._noisy,
            blurred=self._blurred,
        )

    def _measure(self, truth: RigidBodyState) -> RigidBodyState:
        if not (self._noisy or self._blurred):
            return truth
        columns, steps = self.dynamics.state_type.columns_of(truth), np.array([self._measured])
        self._measured += 1
        found = self._odometer.measure_columns(columns, self.world, self._numbers, self._repeats, steps)
        return self.dynamics.reported_columns(found, truth)
