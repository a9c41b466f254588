"""How many control steps a second the core's batch makes, beside MuJoCo's own batch rollout.

Both are measured in turns and on the same number of cores, so that whatever else the machine does slows both; medians
count. A step of the batch is a whole step of training: command, disturbances, motion, odometry, observation, reward
and, where episodes end, new ones; worlds are shared out among processes. A step of MuJoCo is its physics alone, over
the same control period; MuJoCo's own drag in a fluid stands for the water, which it would need a callback for, so that
the rollout is faster than any boat's could be. Beside it robots on water are rolled out in the plant's own water.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

import mujoco
import mujoco.rollout
import numpy as np
from scipy.spatial.transform import Rotation

from fulmar_core.disturbances.scenario import Scenario
from fulmar_core.episode import draw_episode, episode_steps
from fulmar_core.learning_step import judged_step
from fulmar_core.robot import Robot
from fulmar_core.rotation import Array
from fulmar_core.simulation import BatchSimulation
from fulmar_core.tasks import Task
from sim_nodes.mujoco_model import Scene
from sim_nodes.mujoco_model.floater import Floater

DIFFERENT = 16  # batches of random commands, used again and again
SIMULATED, STRETCH = 64, 10  # robots in one rollout of MuJoCo, and control steps, each with its own command
SEED = 1
_STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS
_CONTROL = mujoco.mjtState.mjSTATE_CTRL | mujoco.mjtState.mjSTATE_XFRC_APPLIED


@dataclass(frozen=True)
class Library:
    """Where the arrays of the batch live."""

    name: str  # numpy or torch
    device: str = "cpu"  # cpu or cuda

    def namespace(self) -> Any:
        """The library's module."""
        if self.name == "numpy":
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
        if self.name == "numpy":
            return values.astype(np.float32)
        import torch

        return torch.as_tensor(values, dtype=torch.float32, device=self.device)

    def numbers(self, truths: Array) -> np.ndarray:
        """Where an array of truth values is true."""
        return np.flatnonzero(truths if self.name == "numpy" else truths.cpu().numpy())


class BatchPace:
    """The core's batch at random commands, with everything that training asks of a step."""

    def __init__(
        self, robot: Robot, task: Task, scenario: Scenario, *, worlds: int, library: Library, first: int = 0
    ) -> None:
        """Build the worlds, numbered from `first` on; the first episodes end at random times."""
        self._robot, self._task, self._library = robot, task, library
        self._simulation = BatchSimulation(
            robot,
            task,
            scenario,
            worlds=worlds,
            seed=SEED,
            first=first,
            training=True,
            xp=library.namespace(),
            device=None if library.name == "numpy" else library.device,
        )
        self._horizon = episode_steps(task, self._simulation.control_dt)
        rng = np.random.default_rng(SEED)
        self._age = rng.integers(0, self._horizon, worlds)
        self._commands = [library.array(_random_commands(robot, worlds, rng)) for _ in range(DIFFERENT)]
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
        self.reward, ended_early = judged_step(simulation, command, robot=self._robot, task=self._task)
        self._age += 1
        ended = self._age >= self._horizon
        ended[self._library.numbers(ended_early)] = True
        self.observation = simulation.observe()
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
        for pipe in self._pipes:
            pipe.recv()

    def steps_per_s(self, seconds: float) -> float:
        """Step for a while; returns how many steps of single worlds were made a second by all together."""
        for pipe in self._pipes:
            pipe.send(seconds)
        return sum(pipe.recv() for pipe in self._pipes)

    def close(self) -> None:
        """Let the processes end."""
        for pipe in self._pipes:
            pipe.close()
        for process in self._processes:
            process.join()


def _serve(pipe: Connection) -> None:
    """What a process does: build worlds, or step them, as it is told."""
    pace: BatchPace | None = None
    while True:
        try:
            order = pipe.recv()
        except EOFError:
            return
        if isinstance(order, float):
            assert pace is not None
            pipe.send(pace.steps_per_s(order))
        else:
            robot, task, scenario, worlds, library, first = order
            pace = BatchPace(robot, task, scenario, worlds=worlds, library=library, first=first)
            pipe.send(None)


class MujocoPace:
    """MuJoCo's batch rollout of the same robot at random commands."""

    def __init__(self, robot: Robot, *, threads: int) -> None:
        """Compile the robot and draw commands.

        Args:
            robot: The robot.
            threads: That MuJoCo may use.
        """
        scene = Scene(robot)
        self._model, model, data = scene.model, scene.model, scene.data
        if robot.hydrodynamics is not None:
            model.opt.gravity[:] = 0.0  # what water would carry must not sink
            model.opt.density, model.opt.viscosity = robot.hydrodynamics.hydrostatics.water_density, 1e-3
        self._datas = [mujoco.MjData(model) for _ in range(threads)]
        held = robot.timing.substeps(robot.timing.control_hz) * scene.machine.steps_per_tick
        controls = _random_controls(robot, scene, SIMULATED * STRETCH)
        self._controls = np.repeat(controls.reshape(SIMULATED, STRETCH, -1), held, axis=1)
        state = np.zeros(mujoco.mj_stateSize(model, _STATE))
        mujoco.mj_resetData(model, data)
        mujoco.mj_getState(model, data, state, _STATE)
        self._states = np.tile(state, (SIMULATED, 1))

    def steps_per_s(self, seconds: float) -> float:
        """Roll out for a while; returns how many control steps of single robots were made a second."""
        began, count = time.perf_counter(), 0
        while time.perf_counter() - began < seconds or not count:
            mujoco.rollout.rollout(
                self._model, self._datas, self._states, self._controls, persistent_pool=True
            )
            count += SIMULATED * STRETCH
        return count / (time.perf_counter() - began)


class AfloatPace:
    """MuJoCo's batch rollout of a robot in the plant's own water, at random commands.

    Its forces follow from where each physics step ends, so the rollout goes step by step, and the water of all robots
    is computed at once in between.

    Attributes:
        states: MuJoCo's full physics state of each robot, shape (worlds, n).
    """

    def __init__(self, robot: Robot, task: Task, scenario: Scenario, *, worlds: int, threads: int) -> None:
        """Put robots on the water and draw commands; as many as the batch has, since few would cost more each."""
        scene = Scene(robot)
        machine, self._model, model = scene.machine, scene.model, scene.model
        assert isinstance(machine, Floater)
        assert machine.water is not None
        self._water = machine.water
        episode = draw_episode(robot, task, scenario, seed=SEED, number=0)
        machine.take_world(model, episode.world)
        mujoco.mj_setConst(model, scene.data)
        mujoco.mj_resetData(model, scene.data)
        machine.place(model, scene.data, episode.start)
        self._datas = [mujoco.MjData(model) for _ in range(threads)]
        state = np.zeros(mujoco.mj_stateSize(model, _STATE))
        mujoco.mj_getState(model, scene.data, state, _STATE)
        self.states = np.tile(state, (worlds, 1))
        self._control = np.zeros((worlds, 1, mujoco.mj_stateSize(model, _CONTROL)))
        self._substeps = robot.timing.substeps(robot.timing.control_hz)
        controls = _random_controls(robot, scene, SIMULATED * DIFFERENT)
        self._thrusts = np.resize(controls, (DIFFERENT, worlds, model.nu))
        self._calm = np.zeros((worlds, 6))

    def steps_per_s(self, seconds: float) -> float:
        """Roll out for a while; returns how many control steps of single robots were made a second."""
        began, count = time.perf_counter(), 0
        while time.perf_counter() - began < seconds or not count:
            thrusts = self._thrusts[count % DIFFERENT]
            for _ in range(self._substeps):
                self.step(thrusts)
            count += 1
        return count * len(self.states) / (time.perf_counter() - began)

    def step(self, thrusts: np.ndarray) -> None:
        """One physics step of all robots at these thrusts, shape (worlds, n) [N].

        A state is time, place, attitude and velocities; a control is thrusts, and a push of every body, the hull last.
        """
        height, attitude, qvel = np.split(self.states[:, 3:14], (1, 5), axis=1)
        to_world = Rotation.from_quat(np.roll(attitude, -1, axis=1)).as_matrix()
        self._control[:, 0, : thrusts.shape[1]] = thrusts
        self._control[:, 0, -6:] = self._water.wrench(height[:, 0], to_world, qvel, thrusts, self._calm)
        states, _ = mujoco.rollout.rollout(
            self._model,
            self._datas,
            self.states,
            self._control,
            control_spec=_CONTROL,
            persistent_pool=True,
        )
        self.states = states[:, 0]


def measure(
    robots: list[Robot],
    task: Task,
    scenario: Scenario,
    *,
    worlds: int,
    library: Library,
    cores: int,
    seconds: float,
    rounds: int,
    progress: Callable[[], None] = lambda: None,
) -> dict[str, dict[str, float]]:
    """Measure robots one after another.

    Args:
        robots: Which.
        task: What the batch plays.
        scenario: What its worlds are drawn from.
        worlds: Of the batch, >= 1.
        library: Of the batch.
        cores: Processes of the batch, and threads of MuJoCo's rollout.
        seconds: Of each measurement [s].
        rounds: Measurements of each, in turns.
        progress: Told after every round.

    Returns:
        For each robot's name the medians `batch_steps_per_s` and `mujoco_steps_per_s`, and their `ratio`; for robots on
        water also `mujoco_with_water_steps_per_s` and `ratio_with_water`.
    """
    found = {}
    with ExitStack() as stack:
        shared = None
        if library.device == "cpu" and cores > 1:
            shared = SharedPace(min(cores, worlds))
            stack.callback(shared.close)
        for robot in robots:
            if shared is not None:
                shared.take(robot, task, scenario, worlds=worlds, library=library)
            batch = shared or BatchPace(robot, task, scenario, worlds=worlds, library=library)
            paces = [batch, MujocoPace(robot, threads=cores)]
            if robot.hydrodynamics is not None:
                paces.append(AfloatPace(robot, task, scenario, worlds=worlds, threads=cores))
            for pace in paces:
                pace.steps_per_s(0.3 * seconds)  # caches and thread pools warm up
            measured = []
            for _ in range(rounds):
                measured.append([pace.steps_per_s(seconds) for pace in paces])
                progress()
            ours, theirs, *wet = (float(value) for value in np.median(np.array(measured), axis=0))
            found[robot.name] = {
                "batch_steps_per_s": ours,
                "mujoco_steps_per_s": theirs,
                "ratio": ours / theirs,
            }
            if wet:
                found[robot.name] |= {
                    "mujoco_with_water_steps_per_s": wet[0],
                    "ratio_with_water": ours / wet[0],
                }
    return found


def _random_commands(robot: Robot, count: int, rng: np.random.Generator) -> np.ndarray:
    actuators = robot.actuators
    return np.asarray(
        actuators.limited(rng.uniform(-1.0, 1.0, (count, len(actuators.names))) * actuators.scale)
    )


def _random_controls(robot: Robot, scene: Scene, count: int) -> np.ndarray:
    """What MuJoCo's actuators do at random commands, shape (count, n)."""
    controls = np.empty((count, scene.model.nu))
    rng = np.random.default_rng(SEED)
    for row, command in zip(controls, _random_commands(robot, count, rng), strict=True):
        scene.machine.drive(scene.model, scene.data, command, np.ones_like(command), (0.0, 0.0, 0.0))
        row[:] = scene.data.ctrl
    return controls
