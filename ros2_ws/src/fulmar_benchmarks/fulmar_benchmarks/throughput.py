"""How many control steps a second the core's batch makes, beside MuJoCo's own batch rollout.

Both are measured in turns and on the same number of cores, so that whatever else the machine does slows both; medians
count. A step of the batch is a whole step of training: command, disturbances, motion, odometry, observation, reward
and, where episodes end, new ones; worlds are shared out among processes. It is compiled (`training.compiled`), or
carried out array by array. A step of MuJoCo (`mujoco_pace`) is its physics alone, over the same control period.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from fulmar_benchmarks.mujoco_pace import DIFFERENT, SEED, AfloatPace, MujocoPace, random_commands
from fulmar_core.disturbances.scenario import Scenario
from fulmar_core.episode import episode_steps
from fulmar_core.errors import ConfigError
from fulmar_core.learning_step import observed_step
from fulmar_core.robot import Robot
from fulmar_core.rotation import Array
from fulmar_core.simulation import BatchSimulation
from fulmar_core.tasks import Task


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


class SharedPace:
    """Some processes that each step their share of the worlds at the same time."""

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

    def take(self, robot: Robot, task: Task, scenario: Scenario, *, worlds: int, library: Library) -> None:
        """Share out the worlds of another robot."""
        bounds = np.linspace(0, worlds, len(self._pipes) + 1).astype(int)
        for pipe, first, last in zip(self._pipes, bounds, bounds[1:], strict=False):
            pipe.send((robot, task, scenario, int(last - first), library, int(first)))
        self._answers()

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
    """What a process does: build worlds, or step them, on request."""
    pace: BatchPace | None = None
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
                robot, task, scenario, worlds, library, first = order
                pace = BatchPace(robot, task, scenario, worlds=worlds, library=library, first=first)
                pipe.send(None)
        except ConfigError as error:
            pipe.send(error)


def measure(
    pairs: Sequence[tuple[Robot, Task]],
    scenario: Scenario,
    *,
    worlds: int,
    library: Library,
    cores: int,
    seconds: float,
    rounds: int,
    progress: Callable[[], None] = lambda: None,
) -> dict[str, dict[str, Any]]:
    """Measure robots one after another.

    Args:
        pairs: Which, and what the batch of each plays.
        scenario: What its worlds are drawn from.
        worlds: Of the batch, >= 1.
        library: Of the batch.
        cores: Processes of the batch, and threads of MuJoCo's rollout.
        seconds: Of each measurement [s].
        rounds: Measurements of each, in turns.
        progress: Called after every round.

    Returns:
        For each robot's name its `task`, MuJoCo's `mujoco_integrator` and `mujoco_step_s`, the medians
        `batch_steps_per_s` and `mujoco_steps_per_s`, and their `ratio`; for robots on water also
        `mujoco_with_water_steps_per_s` and `ratio_with_water`, for robots in space `mujoco_euler_steps_per_s` and
        `ratio_with_euler`.
    """
    found: dict[str, dict[str, Any]] = {}
    with ExitStack() as stack:
        shared = None
        if library.device == "cpu" and cores > 1:
            shared = SharedPace(min(cores, worlds))
            stack.callback(shared.close)
        for robot, task in pairs:
            if shared is not None:
                shared.take(robot, task, scenario, worlds=worlds, library=library)
            batch = shared or BatchPace(robot, task, scenario, worlds=worlds, library=library)
            rollout = MujocoPace(robot, threads=cores)
            paces: list[MujocoPace | AfloatPace | SharedPace | BatchPace] = [batch, rollout]
            other = ""
            if robot.hydrodynamics is not None:
                other = "water"
                paces.append(AfloatPace(robot, task, scenario, worlds=worlds, threads=cores))
            elif rollout.integrator == "RK4":
                other = "euler"
                paces.append(MujocoPace(robot, threads=cores, integrator="Euler"))
            for pace in paces:
                pace.steps_per_s(0.3 * seconds)  # caches and thread pools warm up
            measured = []
            for _ in range(rounds):
                measured.append([pace.steps_per_s(seconds) for pace in paces])
                progress()
            ours, theirs, *more = (float(value) for value in np.median(np.array(measured), axis=0))
            found[robot.name] = {
                "task": task.name,
                "mujoco_integrator": rollout.integrator,
                "mujoco_step_s": rollout.step_s,
                "batch_steps_per_s": ours,
                "mujoco_steps_per_s": theirs,
                "ratio": ours / theirs,
            }
            if more:
                name = f"mujoco_{other}" if other == "euler" else f"mujoco_with_{other}"
                found[robot.name] |= {f"{name}_steps_per_s": more[0], f"ratio_with_{other}": ours / more[0]}
    return found
