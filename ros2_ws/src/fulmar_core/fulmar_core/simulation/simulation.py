"""Many worlds of one robot at one task, moved by the core's own dynamics in one batch."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Generic

import numpy as np
from array_api_compat import is_numpy_namespace

from fulmar_core.dynamics.batch_dynamics import Dynamics, Steps
from fulmar_core.dynamics.by_kind import actuation_of, dynamics_of
from fulmar_core.dynamics.motion import may_be_off_centre, may_open_late, tank_empties
from fulmar_core.dynamics.things import Poses
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.batch_link import BatchLink, longest_way
from fulmar_core.simulation.episode import Alter, draw_episodes
from fulmar_core.simulation.episode_prefetch import Beginning, UpcomingEpisodes
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.counter_rng import Keys, keys_at, uniform_from, words, world_keys, write_keys
from fulmar_core.states.mutable_state import MutableState
from fulmar_core.states.rotation import Array
from fulmar_core.states.state import S
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import Goal
from fulmar_core.tasks.observation import Observer, slewed
from fulmar_core.worlds.scenario import Scenario, longest_delay
from fulmar_core.worlds.world import World

ACTUATOR_NOISE = 3  # stream of random numbers, beside those of `counter_rng`


class BatchSimulation(MutableState, Generic[S]):
    """Worlds that step together; each is reset by itself.

    Attributes:
        truth: True state, shapes (worlds,).
        measured: What the odometry reports of it.
        goal: Goal of each world.
        command: What was last commanded, after every limit, shape (worlds, n).
    """

    MUTABLE = (
        "truth", "measured", "goal", "world", "command",
        "_repeats", "_steps", "_noise_keys",
    )  # fmt: skip

    truth: S
    measured: S
    goal: Goal
    world: Any

    def __init__(
        self,
        robot: Robot,
        task: Task,
        scenario: Scenario,
        *,
        worlds: int,
        seed: int,
        first: int = 0,
        control_hz: float | None = None,
        training: bool = False,
        xp: Any = np,
        device: Any = None,
        dtype: Any = None,
        alter: Alter | None = None,
    ) -> None:
        """Build the worlds and reset them all.

        Args:
            robot: The robot.
            task: Says where episodes start.
            scenario: Says what may differ from world to world.
            worlds: Number of worlds, >= 1.
            seed: World w draws its episodes from (seed, first + w).
            first: Number of the first world, >= 0.
            control_hz: Command rate; the robot's own by default [Hz].
            training: Start episodes where learning starts.
            xp: Array library: NumPy, or torch.
            device: Where its arrays live, for torch.
            dtype: Floating type; the library's float32 by default.
            alter: Changes the episodes, as in `draw_episodes`.
        """
        self.robot, self.task, self.scenario, self.seed = robot, task.fitted(robot), scenario, seed
        self.worlds, self.training = worlds, training
        self._first, self._alter = first, alter
        self.substeps = robot.timing.substeps(control_hz or robot.timing.control_hz)
        self.observer = Observer(robot, self.task)
        self._xp = array_namespace(xp.empty(0))  # the library itself may lack parts of the array standard
        self._device, self._dtype = device, dtype or xp.float32
        self._numbers = self._whole(first + np.arange(worlds))
        self._repeats = self._whole(np.zeros(worlds))
        self._steps = self._whole(np.zeros(worlds))
        self._noise_keys = self._actuator_keys(self._numbers, self._repeats)
        self._dynamics: Dynamics[Any, S] = dynamics_of(robot, scenario)
        self._latest_s = longest_delay(robot, scenario) + longest_way(scenario.link)
        self._off_centre = may_be_off_centre(robot, scenario)
        self._noisy = scenario.actuation.noise > 0.0
        self._odometer = self._dynamics.odometer(
            robot.sensors.odometry,
            seed=seed,
            period=self.control_dt,
            max_delay_s=scenario.sensing.delay_s,
            noisy=scenario.sensor_noise,
            blurred=scenario.sensing.blurred,
        )
        self._upcoming = UpcomingEpisodes(self._draw, worlds)
        drawn = self._draw_parts(np.arange(worlds), np.zeros(worlds, dtype=int))
        self.truth, self.goal, self.world, self.command = drawn
        self._actuation = actuation_of(
            robot,
            self._applied_at_start(self.command),
            opens_late=may_open_late(robot, scenario),
            latest_s=self._latest_s,
            step_s=self.control_dt,
            changes=scenario.actuation.changes,
            world=self.world if tank_empties(robot, scenario) else None,
        )
        self._link: BatchLink | None = None
        if scenario.link.acts:
            self._link = BatchLink(scenario.link, robot, self.command, seed=seed, control_dt=self.control_dt)
        self._measure()

    @property
    def control_dt(self) -> float:
        """Time of one control step [s]."""
        return self.substeps * self.robot.timing.physics_dt

    def observe(self, worlds: np.ndarray | None = None) -> Array:
        """Observations of some worlds, all by default, shape (worlds, n)."""
        fuel = self._actuation.fuel_share if self.observer.sees_fuel else None
        if worlds is None:
            return self.observer(self.measured, self.goal, self.command, fuel)
        index = self._whole(worlds)
        left = None if fuel is None else fuel[index]
        return self.observer(self.measured[index], self.goal[index], self.command[index], left)

    def reset(self, worlds: Sequence[int] | np.ndarray | range) -> None:
        """Begin a new episode in the worlds of these numbers."""
        which = np.asarray(worlds, dtype=int)
        if which.size == 0:
            return
        index = self._whole(which)
        self._repeats[index] = self._repeats[index] + 1
        self._steps[index] = 0
        coming = self._upcoming.begin(which, self._repeats_now())
        self.truth.write(index, coming.start[index])
        self.goal.write(index, coming.goal[index])
        self.world.adopt(index, coming.world)
        write_keys(self._noise_keys, index, keys_at(coming.noise_keys, index))
        self.command = self._xp.asarray(self.command, copy=True)
        self.command[index] = coming.command[index]
        self._actuation.reset(index, self._applied_at_start(self.command)[:, index])
        if self._link is not None:
            self._link.reset(index, self.command)
        self.measured = self._odometer.restart(self.truth, index, coming.reading)

    def put(self, state: S, goal: Goal, command: Array) -> None:
        """Put every world's robot somewhere else, for drives that begin under way.

        Args:
            state: Where it is and how it moves, shapes (worlds,).
            goal: What it shall do.
            command: What its actuators do, within their limits, shape (worlds, n).
        """
        self.truth = state.mapped(self._real)
        self.goal = goal.mapped(self._real)
        self.command = self._real(command)
        self._actuation.hold(self._xp.asarray(self.command.T, copy=True))
        self._measure()

    @property
    def things(self) -> Poses:
        """Where the task's things are, each (worlds, 3)."""
        return {thing.name: self.goal.things[thing.name] for thing in self.task.things}

    @property
    def readings(self) -> dict[str, np.ndarray]:
        """What is measured beside the odometry, without errors: speeds of reaction wheels, see `Inputs.readings`."""
        return self._actuation.readings

    def step(self, command: Array) -> None:
        """Do one control step of a learner: limit and apply its command, and advance the goals by what is measured.

        Args:
            command: Anything finite, shape (worlds, n).
        """
        xp = self._xp
        given = self._real(command)
        # One actuator after the other in memory, worlds side by side: most of what follows goes actuator by actuator.
        by_actuator = xp.stack([given[:, i] for i in range(given.shape[1])])
        wanted = self.robot.actuators.limited(by_actuator.T)
        self._move(slewed(wanted, self.command, self.robot, self.control_dt))
        time_s = xp.astype(self._steps, self._dtype) * self.control_dt
        self.goal = self.task.advance(self.goal, self.measured, time_s)

    def move(self, command: Array) -> None:
        """Apply one command for one control step, as a backend does; goals advance where they are followed.

        Args:
            command: Within every limit, shape (worlds, n).
        """
        self._move(self._real(command))

    def _move(self, command: Array) -> None:
        xp = self._xp
        self.command = command
        noise = None
        if self._noisy:
            bits = words(self._noise_keys, self._steps, self.command.shape[1])
            noise = 2.0 * uniform_from(bits, self._dtype) - 1.0
        received, world = command, self.world
        if self._link is not None:
            received, late = self._link.carry(command, self._numbers, self._repeats, self._steps)
            world = replace(world, action_delay=world.action_delay + late)
        self._actuation.begin(received.T, world, noise)
        time_s = xp.astype(self._steps, self._dtype) * self.control_dt
        before = self.truth
        self.truth = self._dynamics.move(
            before,
            self._actuation,
            self.world,
            self._dynamics.outside(before, self.world, time_s, self.control_dt),
            Steps(self.substeps, self._latest_s, self._off_centre),
        )
        self._steps = self._steps + 1
        if self.task.things:
            moved, self.truth = self._dynamics.push_things(self.task.things, self.things, before, self.truth)
            self.goal = self.goal.among(moved)
        self._measure()

    def mutable_state(self) -> dict[str, Any]:
        """As `MutableState.mutable_state`, with that of actuators and odometer as dictionaries of their own."""
        parts = {"_actuation": self._actuation.mutable_state(), "_odometer": self._odometer.mutable_state()}
        if self._link is not None:
            parts["_link"] = self._link.mutable_state()
        return super().mutable_state() | parts

    def take(self, state: dict[str, Any]) -> None:
        """As `MutableState.take`."""
        super().take(state)
        self._actuation.take(state["_actuation"])
        self._odometer.take(state["_odometer"])
        if self._link is not None:
            self._link.take(state["_link"])

    def snapshot(self) -> dict[str, Any]:
        """Everything that moves, as a copy of its own that pickles."""
        return copy.deepcopy(self.mutable_state())

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot of a simulation that was built alike."""
        if snapshot["goal"].things.keys() != self.goal.things.keys():
            raise ValueError("the snapshot has other things.")
        self.take(copy.deepcopy(snapshot))
        self._upcoming.forget()

    def _draw(self, worlds: np.ndarray, repeats: np.ndarray) -> Beginning:
        """How some worlds begin, in the simulation's own arrays."""
        start, goal, world, command = self._draw_parts(worlds, repeats)
        numbers, repeated = self._whole(self._first + worlds), self._whole(repeats)
        reading = self._odometer.first(start, world, numbers, repeated)
        keys = self._actuator_keys(numbers, repeated)
        return Beginning(start, goal, world, command, keys, reading)

    def _applied_at_start(self, command: Array) -> Array:
        """What actuators do at the start, shape (n, worlds): their command, where they are alive."""
        return self._xp.asarray(command.T, copy=True) * self.world.alive

    def _draw_parts(self, worlds: np.ndarray, repeats: np.ndarray) -> tuple[S, Goal, World, Array]:
        drawn = draw_episodes(
            self.robot,
            self.task,
            self.scenario,
            seed=self.seed,
            numbers=self._first + worlds,
            repeats=repeats,
            training=self.training,
            alter=self._alter,
        )
        return (
            drawn.start.mapped(self._real),
            drawn.goal.mapped(self._side_by_side),
            drawn.world.mapped(self._real).packed(),
            self._real(drawn.command),
        )

    def _repeats_now(self) -> np.ndarray:
        """How often each world has begun anew, as NumPy."""
        return np.array(self._repeats.cpu().numpy() if self._on_torch else self._repeats)

    def _actuator_keys(self, numbers: Array, repeats: Array) -> Keys:
        return world_keys(self.seed, numbers, repeats, ACTUATOR_NOISE)

    def _measure(self) -> None:
        self.measured = self._odometer.measure(
            self.truth, self.world, self._numbers, self._repeats, self._steps
        )

    @property
    def _on_torch(self) -> bool:
        return not is_numpy_namespace(self._xp)

    def _real(self, values: Array) -> Array:
        """A copy of its own, in the simulation's floating type, where its arrays live."""
        kwargs = {} if self._device is None else {"device": self._device}
        return self._xp.asarray(values, dtype=self._dtype, copy=True, **kwargs)

    def _side_by_side(self, values: Array) -> Array:
        """As `_real`, with the same number of all worlds beside one another in memory, as in all else that moves."""
        xp = self._xp
        return xp.moveaxis(self._real(np.ascontiguousarray(np.moveaxis(values, 0, -1))), -1, 0)

    def _whole(self, values: np.ndarray) -> Array:
        kwargs = {} if self._device is None else {"device": self._device}
        return self._xp.asarray(np.asarray(values, dtype=np.int64), **kwargs)
