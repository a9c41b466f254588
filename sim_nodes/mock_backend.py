"""The core's dynamics as a backend, for machines without MuJoCo."""

from __future__ import annotations

import numpy as np

from fulmar_core.dynamics.batch_dynamics import Steps
from fulmar_core.dynamics.things import Poses, Thing
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.kind import Truth
from fulmar_core.robots.sensors.simulated import SimulatedSensors
from fulmar_core.simulation.backend import Sample
from fulmar_core.simulation.episode import Episode
from fulmar_core.states.state import RigidBodyState, State
from fulmar_core.wires.reading import Reading
from sim_nodes.one_world import OneWorld


class MockBackend:
    """One robot in the core's dynamics, measured without noise, without an inertial unit."""

    def __init__(self, robot: Robot, *, things: tuple[Thing, ...] = ()) -> None:
        self.robot, self._things = robot, things
        self._world = OneWorld(robot, noisy=False)
        self._sensors = SimulatedSensors(robot.sensors.specs, noisy=False)

    def reset(self, episode: Episode, *, seed: int, number: int = 0) -> Sample:
        """Begin anew; see `Backend.reset`."""
        self._state: State = episode.start.mapped(lambda part: np.array([part], dtype=float))
        self._poses: Poses = {
            thing.name: np.array([episode.goal.things[thing.name]], dtype=float) for thing in self._things
        }
        self._world.reset(episode, self._state[0].to_rigid(), seed=seed, number=number)
        self._sensors.reset(seed, number)
        self._ticks = 0
        return self._sample()

    def step(self, command: np.ndarray, ticks: int = 1, *, begins: int | None = None) -> Sample:
        """Apply a command; see `Backend.step`."""
        world, before = self._world, self._state
        world.begin(np.asarray(command, dtype=float), ticks, before[0].to_rigid(), begins=begins)
        after = world.dynamics.move(
            before,
            world.actuation,
            world.world,
            world.outside,
            Steps(ticks, world.latest_s, world.dynamics.is_off_centre(world.world)),
        )
        self._poses, self._state = world.dynamics.push_things(self._things, self._poses, before, after)
        return self._sample(ticks)

    def stand(self, ticks: int = 1, *, begins: int | None = None) -> Sample:
        """Let time pass for a body that nothing moves; see `CanStand.stand`."""
        rest = np.array(self.robot.actuators.safe_command)
        self._world.begin(rest, ticks, self._state[0].to_rigid(), begins=begins)
        self._state = self._state.stopped()
        return self._sample(ticks)

    def place(self, state: RigidBodyState) -> None:
        """See `CanPlace.place`."""
        columns = self.robot.state_type.from_rigid(state)
        self._state = columns.mapped(lambda part: np.array([part], dtype=float))

    @property
    def time_s(self) -> float:
        """Simulated time since the episode began [s]."""
        return self._ticks * self.robot.timing.physics_dt

    def push(self, force: tuple[float, ...] | None) -> None:
        """See `CanPush.push`."""
        self._world.extra = force

    def make_safe(self) -> None:
        """Nothing to do: a command acts only during a step."""

    def close(self) -> None:
        """Nothing to release."""

    def _sample(self, ticks: int = 0) -> Sample:
        self._ticks += ticks
        truth = self._state[0].to_rigid()
        world = self._world
        true = Truth(truth, more=world.dynamics.truths(self._state, world.actuation, world.world))
        others = self._sensors.measure(true, self._ticks * self.robot.timing.physics_dt)
        things = {name: pose[0] for name, pose in self._poses.items()}
        return Sample({"odometry": Reading(truth), **others}, truth, things)
