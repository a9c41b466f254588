"""How many control steps a second the core's batch makes, beside MuJoCo's own batch rollout and JSBSim.

All are measured in turns and on the same number of cores, so that whatever else the machine does slows both; medians
count. A step of the batch is a whole step of training: command, disturbances, motion, odometry, observation, reward
and, where episodes end, new ones; worlds are shared out among processes. It is compiled (`training.compiled`), or
carried out array by array. A step of MuJoCo (`mujoco_pace`) is its physics alone, over the same control period; so is
one of JSBSim (`jsbsim_pace`), which flies the aircraft only, one in each process.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from multiprocessing.connection import Connection
from typing import Any, Protocol

import numpy as np

from fulmar_benchmarks.mujoco_pace import DIFFERENT, SEED, AfloatPace, MujocoPace, random_commands
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.episode import episode_steps
from fulmar_core.simulation.learning_step import observed_step
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.rotation import Array
from fulmar_core.tasks import Task
from fulmar_core.worlds.scenario import Scenario

# What is timed beside the batch, and the name of the ratio to it.
ROUNDS = 5  # measurements of each, in turns
MUJOCO, IN_WATER, BY_EULER, JSBSIM = "mujoco", "mujoco_with_water", "mujoco_euler", "jsbsim"
RATIOS = {
    MUJOCO: "ratio",
    IN_WATER: "ratio_with_water",
    BY_EULER: "ratio_with_euler",
    JSBSIM: "ratio_with_jsbsim",
}


@dataclass(frozen=True)
class Library:
    """Where the arrays of the batch live, and who computes with them."""

    name: str  # numpy, compiled (NumPy's arrays, a kernel of torch's compiler) or torch
    device: str = "cpu"  # cpu or cuda

    def namespace(self) -> Any:
        """The module of the arrays."""
        if self.name != "torch":
            return np
        import torch

        if self.device == "cpu":
            torch.set_num_threads(
                1
            )  # worlds are shared out among processes; threads would only wait for each other
        return torch

    def finish(self) -> None:
        """Wait until everything is computed."""
        if self.device != "cpu":
            import torch

            torch.cuda.synchronize()

    def array(self, values: np.ndarray) -> Array:
        """Values in single precision, where they are needed."""
        if self.name != "torch":
            return values.astype(np.float32)
        import torch

        return torch.as_tensor(values, dtype=torch.float32, device=self.device)

    def numbers(self, truths: Array) -> np.ndarray:
        """Where an array of truth values is true."""
        return np.flatnonzero(truths.cpu().numpy() if self.name == "torch" else truths)

    def step_of(self, simulation: BatchSimulation) -> Callable[..., tuple[Array, Array, Array]]:
        """How a batch moves: `observed_step` of the command and what effort costs."""
        if self.name != "compiled":
            return partial(observed_step, simulation)
        import torch

        from training.compiled import CompiledStep

        torch.set_num_threads(1)  # as in `namespace`
        return CompiledStep(simulation)


class BatchPace:
    """The core's batch at random commands, with everything that training asks of a step."""

    def __init__(
        self, robot: Robot, task: Task, scenario: Scenario, *, worlds: int, library: Library, first: int = 0
    ) -> None:
        """Build the worlds, numbered from `first` on; the first episodes end at random times."""
        self._effort, self._library = robot.costs.effort, library
        self._simulation = BatchSimulation(
            robot,
            task,
            scenario,
            worlds=worlds,
            seed=SEED,
            first=first,
            training=True,
            xp=library.namespace(),
            device=library.device if library.name == "torch" else None,
        )
        self._observed_step = library.step_of(self._simulation)
        self._horizon = episode_steps(task, self._simulation.control_dt)
        rng = np.random.default_rng(SEED)
        self._age = rng.integers(0, self._horizon, worlds)
        self._commands = [library.array(random_commands(robot, worlds, rng)) for _ in range(DIFFERENT)]
        self._at = 0

    def steps_per_s(self, seconds: float) -> float:
        """Step for a while; returns how many steps of single worlds were made a second."""
        worlds, began, count = self._age.size, time.perf_counter(), 0
        while time.perf_counter() - began < seconds or not count:
            self._step()
            count += 1
        self._library.finish()
        return count * worlds / (time.perf_counter() - began)

    def _step(self) -> None:
        simulation = self._simulation
        command = self._commands[self._at]
        self._at = (self._at + 1) % DIFFERENT
        self.reward, ended_early, self.observation = self._observed_step(command, effort=self._effort)
        self._age += 1
        ended = self._age >= self._horizon
        ended[self._library.numbers(ended_early)] = True
        over = np.flatnonzero(ended)
        if over.size:
            simulation.reset(over)
            self._age[over] = 0
            self.observation[over] = simulation.observe(over)


class Pace(Protocol):
    """What can be timed."""

    def steps_per_s(self, seconds: float) -> float:
        """Step for a while; returns how many control steps of single robots were made a second."""


class SharedPace:
    """Some processes that each step something at the same time."""

    def __init__(self, processes: int) -> None:
        """Start them; they wait for `take`."""
        context = multiprocessing.get_context("spawn")
        self._pipes, self._processes = [], []
        for _ in range(processes):
            ours, theirs = context.Pipe()
            self._pipes.append(ours)
            self._processes.append(context.Process(target=_serve, args=(theirs,), daemon=True))
            self._processes[-1].start()
            theirs.close()

    def take(self, makers: Iterable[Callable[[], Pace]]) -> None:
        """Let each process make what it is to step.

        Raises:
            ConfigError: One of them cannot.
        """
        for pipe, maker in zip(self._pipes, makers, strict=True):
            pipe.send(maker)
        self._answers()

    def __len__(self) -> int:
        """How many processes."""
        return len(self._pipes)

    def steps_per_s(self, seconds: float) -> float:
        """Step for a while; returns how many steps of single worlds were made a second by all together."""
        for pipe in self._pipes:
            pipe.send(seconds)
        return sum(self._answers())

    def _answers(self) -> list[Any]:
        """What all of them say, or the first complaint."""
        answers = [pipe.recv() for pipe in self._pipes]
        for answer in answers:
            if isinstance(answer, ConfigError):
                raise answer
        return answers

    def close(self) -> None:
        """Let the processes end."""
        for pipe in self._pipes:
            pipe.close()
        for process in self._processes:
            process.join()


def _serve(pipe: Connection) -> None:
    """What a process does: make what it steps, or step it, on request."""
    pace: Pace | None = None
    while True:
        try:
            order = pipe.recv()
        except EOFError:
            return
        try:
            if isinstance(order, float):
                assert pace is not None
                pipe.send(pace.steps_per_s(order))
            else:
                pace = order()
                pipe.send(None)
        except ConfigError as error:
            pipe.send(error)


def shared_worlds(
    robot: Robot, task: Task, scenario: Scenario, *, worlds: int, library: Library, processes: int
) -> list[Callable[[], Pace]]:
    """The batch of each process, so that all of them have the worlds."""
    bounds = np.linspace(0, worlds, processes + 1).astype(int)
    return [
        partial(BatchPace, robot, task, scenario, worlds=int(last - first), library=library, first=int(first))
        for first, last in pairwise(bounds)
    ]


def measure(
    robot: Robot,
    task: Task,
    scenario: Scenario,
    *,
    worlds: int,
    library: Library,
    cores: int,
    seconds: float,
    progress: Callable[[float], None] = lambda rounds: None,
) -> dict[str, Any]:
    """Measure one robot, in turns with what else moves it.

    Args:
        robot: Which.
        task: What the batch plays.
        scenario: What its worlds are drawn from.
        worlds: Of the batch, >= 1.
        library: Of the batch.
        cores: Processes of the batch and of JSBSim, and threads of MuJoCo's rollout.
        seconds: Of each measurement [s].
        progress: Called after every round, with how many are over.

    Returns:
        Its `task` and medians of `ROUNDS` measurements: `batch_steps_per_s`, `<other>_steps_per_s` of what else moves
        it, and its ratio to that, by the names of `RATIOS`; with MuJoCo also `mujoco_integrator` and `mujoco_step_s`.
        Aircraft fly in JSBSim in MuJoCo's place, which has no air of theirs.
    """
    with ExitStack() as stack:
        batch: Pace
        if library.device == "cpu" and cores > 1:
            shared = SharedPace(min(cores, worlds))
            stack.callback(shared.close)
            parts = shared_worlds(
                robot, task, scenario, worlds=worlds, library=library, processes=len(shared)
            )
            shared.take(parts)
            batch = shared
        else:
            batch = BatchPace(robot, task, scenario, worlds=worlds, library=library)
        others = _others(robot, task, scenario, worlds=worlds, cores=cores, stack=stack)
        paces = [batch, *others.values()]
        for pace in paces:
            pace.steps_per_s(0.3 * seconds)  # caches and thread pools warm up
        measured = []
        for done in range(ROUNDS):
            measured.append([pace.steps_per_s(seconds) for pace in paces])
            progress(float(done + 1))
    ours, *theirs = (float(value) for value in np.median(np.array(measured), axis=0))
    figures: dict[str, Any] = {"task": task.name, "batch_steps_per_s": ours}
    for (name, pace), its in zip(others.items(), theirs, strict=True):
        figures |= {f"{name}_steps_per_s": its, RATIOS[name]: ours / its}
        if name == MUJOCO and isinstance(pace, MujocoPace):
            figures |= {"mujoco_integrator": pace.integrator, "mujoco_step_s": pace.step_s}
    return figures


def _others(
    robot: Robot, task: Task, scenario: Scenario, *, worlds: int, cores: int, stack: ExitStack
) -> dict[str, Pace]:
    """What else moves a robot, by the names of `RATIOS`; the stack ends the processes."""
    if robot.flies:
        from fulmar_benchmarks.jsbsim_pace import JsbsimPace  # of an extra

        flown = SharedPace(cores)
        stack.callback(flown.close)
        flown.take(cores * [partial(JsbsimPace, robot, scenario.air.turbulence)])
        return {JSBSIM: flown}
    rollout = MujocoPace(robot, threads=cores)
    if robot.hydrodynamics is not None:
        return {
            MUJOCO: rollout,
            IN_WATER: AfloatPace(robot, task, scenario, worlds=worlds, threads=cores),
        }
    if rollout.integrator == "RK4":
        return {MUJOCO: rollout, BY_EULER: MujocoPace(robot, threads=cores, integrator="Euler")}
    return {MUJOCO: rollout}
