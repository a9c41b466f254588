"""Several robots in one MuJoCo world: each is a backend of its own, and the world moves on when all are ready.

In lock step the world waits for every robot that takes part. By the clock it waits for a fraction of a tick, and goes
on with the last command of a robot that is late. The ticks that a robot missed are over: its next step does not do them
again, and its sample says how many they were, so that all robots have one time. A robot that leaves stays where physics
takes it, with its actuators in their safe state, and the others go on.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from fulmar_core.config.errors import ConfigError, SafetyError
from fulmar_core.dynamics.motion import left_of
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.kind import Truth
from fulmar_core.robots.sensors.simulated import SimulatedSensors
from fulmar_core.simulation.backend import Sample
from fulmar_core.simulation.episode import Episode
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import Task
from fulmar_core.wires.reading import Reading
from fulmar_core.worlds.scenario import Scenario, sensors_in
from sim_nodes.mujoco_model.fleet_scene import FleetPart, FleetScene
from sim_nodes.one_world import OneWorld

LATE_SHARE = 0.25  # of a tick that the world waits, by the clock, for robots that are late
BEGINS_S = 10.0  # that a robot waits, by the clock, for the others to begin


@dataclass(frozen=True)
class Member:
    """What a robot of a fleet is and does."""

    robot: Robot
    task: Task
    scenario: Scenario


class FleetWorld:
    """The world of a fleet.

    Attributes:
        robots: Backend of each robot, by its name.
        ticks: Physics ticks so far.
    """

    def __init__(
        self,
        members: Mapping[str, Member],
        *,
        lockstep: bool,
        rate: float = 1.0,
        on_tick: Callable[[int], None] = lambda _ticks: None,
    ) -> None:
        """Compile the world.

        Args:
            members: By name.
            lockstep: Whether the world waits for every robot, however long it takes.
            rate: Simulated seconds a wall-clock second, where not in lock step.
            on_tick: Called with the number of ticks after they were done, by the thread of any robot.

        Raises:
            ConfigError: As in `FleetScene`, or a task brings obstacles or things, which this world has not.
        """
        for name, member in members.items():
            if member.task.sees_obstacles or member.task.things:
                raise ConfigError(
                    f"robot '{name}': task '{member.task.name}' brings obstacles or things to push, and the world of a "
                    "fleet has robots alone. Give another task."
                )
        self._scene = FleetScene({name: member.robot for name, member in members.items()})
        self._lockstep, self._on_tick = lockstep, on_tick
        self.tick_s = next(iter(members.values())).robot.timing.physics_dt
        self._late_s = LATE_SHARE * self.tick_s / rate
        self._turn = threading.Condition()
        self._rounds = self.ticks = 0
        self.robots = {
            name: FleetRobot(self, self._scene.parts[name], member) for name, member in members.items()
        }
        self._awaited = set(self.robots)  # that have not begun

    def begin(self, robot: FleetRobot, place: Callable[[], None]) -> None:
        """Put a robot where it starts, and wait until every other one is where it starts."""
        with self._turn:
            place()
            robot.takes_part, robot.left_ticks = True, 0
            robot.more_ticks, robot.read_ticks = self.ticks - robot.read_ticks, self.ticks
            self._awaited.discard(robot.name)
            mujoco.mj_forward(self._scene.model, self._scene.data)
            for each in [robot] if self._awaited else list(self.robots.values()):
                each.read()  # once all are where they start, each knows the others
            self._turn.notify_all()
            begun = self._turn.wait_for(
                lambda: not (self._awaited and robot.takes_part), None if self._lockstep else BEGINS_S
            )
            if not begun:
                self._awaited.clear()

    def advance(self, robot: FleetRobot, take: Callable[[], None], ticks: int) -> None:
        """Let a robot take a command, and ticks pass for it; returns once they have.

        Those that the world did since the robot's last sample count: it came late for them.
        """
        with self._turn:
            take()
            before = robot.read_ticks
            robot.left_ticks = max(0, ticks - (self.ticks - before))
            if not robot.left_ticks:
                self._read(robot)
            self._move()
            if self._lockstep:
                self._turn.wait_for(lambda: robot.left_ticks == 0)
            while robot.left_ticks:
                rounds = self._rounds
                if not self._turn.wait_for(lambda: self._rounds != rounds, self._late_s):  # noqa: B023
                    self._move(late=True)
            robot.more_ticks = max(0, robot.read_ticks - before - ticks)

    def begin_all(self, episodes: Mapping[str, Episode], *, seed: int) -> dict[str, Sample]:
        """Begin an episode of every robot, from one thread; see `Backend.reset`."""
        self._awaited.clear()
        for _ in range(2):  # after the first round each robot knows where the others are
            samples = {
                name: self.robots[name].reset(episode, seed=seed) for name, episode in episodes.items()
            }
        return samples

    def step_all(self, commands: Mapping[str, np.ndarray], ticks: int) -> dict[str, Sample]:
        """Apply a command of every robot, from one thread; see `Backend.step`."""
        with self._turn:
            for name, command in commands.items():
                self.robots[name].take(np.asarray(command, dtype=float), ticks, None, stands=False)
                self.robots[name].left_ticks = ticks
            self._move()
        return {name: self.robots[name].sample() for name in commands}

    def leave(self, robot: FleetRobot, rest: Callable[[], None]) -> None:
        """Let the others go on without waiting for a robot, whose actuators come to rest."""
        with self._turn:
            robot.takes_part, robot.left_ticks = False, 0
            self._awaited.discard(robot.name)
            rest()
            self._move()
            self._turn.notify_all()

    def _move(self, *, late: bool = False) -> None:
        """Do the ticks that every robot is ready for; `late`: those that are not ready are not waited for."""
        taking = [robot for robot in self.robots.values() if robot.takes_part]
        ready = [robot for robot in taking if robot.left_ticks]
        if self._awaited or not ready or not (late or len(ready) == len(taking)):
            return
        count = min(robot.left_ticks for robot in ready)
        for _ in range(count):
            self._tick()
        mujoco.mj_forward(self._scene.model, self._scene.data)
        self._rounds += 1
        self.ticks += count
        for robot in ready:
            robot.left_ticks -= count
            if not robot.left_ticks:
                self._read(robot)
        self._on_tick(self.ticks)
        self._turn.notify_all()

    def _read(self, robot: FleetRobot) -> None:
        robot.read()
        robot.read_ticks = self.ticks

    def _tick(self) -> None:
        begun = [robot for robot in self.robots.values() if robot.commanded]
        for robot in begun:
            robot.actuate(self.tick_s)
        for _ in range(self._scene.steps_per_tick):
            for robot in begun:
                robot.drive()
            mujoco.mj_step(self._scene.model, self._scene.data)
            for robot in self.robots.values():
                robot.hold()


class FleetRobot:
    """One robot of a fleet's world, as a backend; see `Backend` and `CanStand`.

    Attributes:
        name: Of the robot.
        takes_part: Whether the world waits for it.
        left_ticks: That it waits for.
        read_ticks: Of the world, when its last sample was read.
        more_ticks: That passed before that sample beside those it asked for: it was late.
        commanded: Whether a command has come since its episode began; before, it stays where it starts.
        is_driven: Whether its plant applies what its controller commands; asked while it takes part.
    """

    def __init__(self, world: FleetWorld, part: FleetPart, member: Member) -> None:
        self.robot, self.name = member.robot, part.name
        self._fleet, self._part = world, part
        noisy = member.scenario.sensor_noise
        self._sensors = SimulatedSensors(
            sensors_in(member.robot, member.scenario) or member.robot.sensors.specs, noisy=noisy
        )
        self._world = OneWorld(member.robot, noisy=noisy)
        self.takes_part, self.left_ticks, self.commanded = False, 0, False
        self.read_ticks = self.more_ticks = 0
        self._stands = True  # where it is, until it begins
        self._at = self._part.data.qpos.copy()
        self._truth: Truth | None = None
        self._others: dict[str, np.ndarray] = {}
        self.is_driven: Callable[[], bool] = lambda: True

    def reset(self, episode: Episode, *, seed: int, number: int = 0) -> Sample:
        """Begin anew; see `Backend.reset`."""

        def place() -> None:
            self._part.begin(episode)
            self._world.begin_episode(episode)
            self.commanded, self._stands, self._at = False, True, self._part.data.qpos.copy()

        self._sensors.reset(seed, number)
        self._fleet.begin(self, place)
        assert self._truth is not None
        state = self._truth.state
        return self._sample(self._world.first_measurement(state, seed=seed, number=number))

    def step(self, command: np.ndarray, ticks: int = 1, *, begins: int | None = None) -> Sample:
        """Apply a command; see `Backend.step`.

        Raises:
            SafetyError: The state is not finite; the message has it.
        """
        return self._pass(np.asarray(command, dtype=float), ticks, begins, stands=False)

    def stand(self, ticks: int = 1, *, begins: int | None = None) -> Sample:
        """Let time pass for a body that nothing moves; see `CanStand.stand`."""
        rest = np.array(self.robot.actuators.safe_command, dtype=float)
        return self._pass(rest, ticks, begins, stands=True)

    @property
    def has_begun(self) -> bool:
        """Whether an episode was ever begun."""
        return hasattr(self._world, "actuation")

    def push(self, force: tuple[float, ...] | None) -> None:
        """See `CanPush.push`."""
        self._world.extra = force

    def make_safe(self) -> None:
        """Bring the actuators to rest, and let the others go on alone."""

        def rest() -> None:
            if self.commanded and self._truth is not None:
                safe = np.array(self.robot.actuators.safe_command, dtype=float)
                self._world.begin(safe, 1, self._truth.state)
                self._stands = False

        self._fleet.leave(self, rest)

    def close(self) -> None:
        """As `make_safe`; the world goes on for the others."""
        self.make_safe()

    def actuate(self, dt: float) -> None:
        """Let the actuators follow their command for a tick [s]."""
        lost = self._world.actuation.lost
        self._applied = self._world.actuation.advance(dt, latest_s=self._world.latest_s)
        if lost is not None:
            share, _ = left_of(self._world.world.mass, lost, self._world.actuation.lost)
            self._part.lighten(float(share[0]))
        self._part.data.time += dt

    def drive(self) -> None:
        """Set every force of the coming step."""
        outside = tuple(float(part[0]) for part in self._world.outside)
        gain = self._world.actuation.gain[:, 0]
        applied = self._applied[:, 0]
        if self._stands:
            applied, outside = np.array(self.robot.actuators.safe_command, dtype=float), (0.0,) * len(outside)
        self._part.robot_model.drive(self._part.model, self._part.data, applied, gain, outside)

    def hold(self) -> None:
        """Put a body that stands back where it was before the step."""
        if self._stands:
            self._part.data.qpos[:], self._part.data.qvel[:] = self._at, 0.0

    def read(self) -> None:
        """Take the true motion from the world; its owner holds the turn."""
        if not (self.has_begun and np.isfinite(self._part.data.qpos).all()):
            return  # not yet; or `_pass` says so, in the thread of this robot
        every = self._part.read()
        position = every["position"]
        position[2] -= self._part.robot_model.rest_height
        w, x, y, z = every["attitude"]
        state = RigidBodyState(position, np.array([x, y, z, w]), every["velocity"], every["gyroscope"])
        more = self._world.actuation.truths() | self._part.robot_model.own_truth(self._part.data)
        self._truth = Truth(state, every["accelerometer"], more)
        others = (robot for robot in self._fleet.robots.values() if robot is not self)
        self._others = {other.name: other.motion() for other in others}

    def motion(self) -> np.ndarray:
        """Now: x, y [m], their rates [m/s], and 1 where it is driven, else 0, shape (5,)."""
        every, driven = self._part.read(), self.takes_part and self.is_driven()
        return np.concatenate((every["position"][:2], every["velocity"][:2], [float(driven)]))

    def take(self, command: np.ndarray, ticks: int, begins: int | None, *, stands: bool) -> None:
        """Take a command for the coming ticks; its owner holds the turn."""
        assert self._truth is not None
        self._world.begin(command, ticks, self._truth.state, begins=begins)
        self._stands, self.commanded = stands, True
        self._at = self._part.data.qpos.copy()

    def sample(self) -> Sample:
        """What is measured after the ticks that were waited for.

        Raises:
            SafetyError: The state is not finite; the message has it.
        """
        assert self._truth is not None
        if not np.isfinite(self._part.data.qpos).all():
            raise SafetyError(
                f"MuJoCo's state of '{self.name}' is not finite at t = {self._part.data.time:.2f} s: "
                f"{self._part.data.qpos}."
            )
        return self._sample(self._world.measure(self._truth.state))

    def _pass(self, command: np.ndarray, ticks: int, begins: int | None, *, stands: bool) -> Sample:
        self._fleet.advance(self, lambda: self.take(command, ticks, begins, stands=stands), ticks)
        return self.sample()

    def _sample(self, odometry: RigidBodyState) -> Sample:
        assert self._truth is not None
        others = self._sensors.measure(self._truth, self._part.data.time)
        return Sample(
            {"odometry": Reading(odometry), **others},
            self._truth.state,
            more_ticks=self.more_ticks,
            neighbours=self._others,
        )
