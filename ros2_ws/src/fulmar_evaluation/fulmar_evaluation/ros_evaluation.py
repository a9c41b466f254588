"""Evaluation of a controller through the nodes it is deployed with: the plant here, the controller in its own process.

Plant and controller are the very nodes of `fulmar run`, in lock step over DDS. Only the truth is read directly from
the simulator, as no deployed node may.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_EXCEPTION, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from types import FrameType
from typing import Any

import numpy as np
from rclpy.lifecycle import TransitionCallbackReturn

from fulmar_bringup.domains import reserved_domains
from fulmar_bringup.goals_row import run_goals_spec
from fulmar_bringup.processes import ProcessGroup, command_line
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.supervisor import START_TIMEOUT_S, Supervisor, supervisor
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import LockstepError, RunFailed
from fulmar_core.config.pool import workers_of
from fulmar_core.config.process import end_with
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.backend import Sample
from fulmar_core.simulation.episode import Episode, draw_episode, episode_steps
from fulmar_core.simulation.metrics import TargetCounter, Trajectories, TrajectoryLog, join, select
from fulmar_core.states.state import State
from fulmar_core.tasks.goal import Goal
from fulmar_core.tasks.path_task import evaluated_task
from fulmar_core.worlds.scenario import load_scenario
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.runtime import SWITCH_INTERVAL_S, settle_memory, spinning
from sim_nodes.sim_node import make_backend

Progress = Callable[[int], None]
Alive = Callable[[], None]
STOPS = (signal.SIGINT, signal.SIGTERM)  # what ends a worker, with its children, at any time


def roll_out_through_ros(
    plan: RunPlan, *, episodes: int, jobs: int, progress: Progress = lambda steps: None
) -> Trajectories:
    """Run episodes 0 to `episodes - 1` of the plan's seed, several side by side.

    A lock-stepped pair of processes keeps about one core busy, since one always waits for the other; so as many
    pairs as there are cores run at once, each in a ROS domain of its own. The episodes do not depend on how many.

    Args:
        plan: Robot, task, controller, backend, rate and seed; its duration is the length of an episode, 0 the task's
            own; its start does not matter.
        episodes: Number of episodes, >= 1.
        jobs: Number of pairs, >= 1.
        progress: Called with how many control steps have been done.

    Returns:
        What happened, from the true states.

    Raises:
        RunFailed: The controller ended or refused to start.
        LockstepError: It did not answer in time.
    """
    with ros_pool(min(jobs, episodes)) as pool:
        return pool.roll_out(plan, episodes=episodes, progress=progress)


class RosPool:
    """Worker processes, each with a ROS domain of its own, that stay for one evaluation after another."""

    def __init__(self, executor: ProcessPoolExecutor, counts: list[Any], domains: list[int]) -> None:
        """Take what `ros_pool` has made; a counter of control steps and a domain for each worker."""
        self._executor, self._counts, self._domains = executor, counts, domains

    def roll_out(
        self, plan: RunPlan, *, episodes: int, progress: Progress = lambda steps: None
    ) -> Trajectories:
        """Run episodes; arguments, result and errors as in `roll_out_through_ros`."""
        jobs = min(len(self._domains), episodes)
        shares = [range(first, episodes, jobs) for first in range(jobs)]
        for count in self._counts:
            count.value = 0
        # Workers inherit that signals are held back, until they are ready for them: none is lost.
        with _signals_held_back():
            futures = [
                self._executor.submit(_work, plan, share, self._domains[index], index)
                for index, share in enumerate(shares)
            ]
        _wait_for_all(futures, lambda: progress(sum(count.value for count in self._counts)))
        return _in_order([future.result() for future in futures], shares)


@contextlib.contextmanager
def ros_pool(jobs: int) -> Iterator[RosPool]:
    """A pool of so many workers until the context ends."""
    spawn = multiprocessing.get_context("spawn")  # a fork would copy threads of DDS that do not survive it
    counts = [spawn.Value("q", 0) for _ in range(jobs)]
    executor = ProcessPoolExecutor(jobs, spawn, _begin_worker, (counts, os.getpid()))
    with reserved_domains(jobs) as domains, _shut_down_in_the_end(executor):
        yield RosPool(executor, counts, domains)


def _wait_for_all(futures: list[Future[Trajectories]], tick: Callable[[], None]) -> None:
    """Wait for all of them, or raise the first error as soon as it is there."""
    pending = set(futures)
    while pending:
        done, pending = wait(pending, timeout=0.2, return_when=FIRST_EXCEPTION)
        tick()
        for future in done:
            try:
                future.result()
            except BrokenProcessPool as error:
                raise RunFailed("a process of the evaluation was ended from outside") from error


@contextlib.contextmanager
def _shut_down_in_the_end(pool: ProcessPoolExecutor) -> Iterator[None]:
    """Wait for the workers; after an error or Ctrl-C, ask them to stop first."""
    try:
        yield
    except BaseException:
        for worker in workers_of(pool):
            if worker.pid is not None:
                os.kill(worker.pid, signal.SIGINT)
        raise
    finally:
        pool.shutdown(cancel_futures=True)


@contextlib.contextmanager
def _signals_held_back() -> Iterator[None]:
    before = signal.pthread_sigmask(signal.SIG_BLOCK, STOPS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


_counts: list[Any] = []
_asked_to_stop: list[int] = []  # signals that this worker has had


def _begin_worker(counts: list[Any], parent: int) -> None:
    """Keep the shared counters in a worker, which must be handed over when it starts, and end on a signal."""
    _counts[:] = counts
    for number in STOPS:
        signal.signal(number, _on_stop)
    end_with(parent, signal.SIGINT)
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, STOPS)
    except SystemExit:  # asked to stop before it began; the pool would print where
        os._exit(1)


def _on_stop(asked: int, _frame: FrameType | None) -> None:
    _asked_to_stop.append(asked)
    for number in STOPS:
        signal.signal(number, signal.SIG_IGN)  # stopping in order must not be disturbed
    raise SystemExit(1)


def _work(plan: RunPlan, numbers: range, domain: int, index: int) -> Trajectories:
    """Do a share; a worker that is asked to stop meanwhile stops its children and takes no further share."""
    try:
        return _roll_out_share(plan, numbers, domain, index)
    finally:
        # Else the pool would take what the stop raised for the outcome of the share and wait for another one. It need
        # not be SystemExit: a module that is being loaded, or a node that is being configured, raises its own error.
        if _asked_to_stop:
            os._exit(1)


def _in_order(runs: list[Trajectories], shares: list[range]) -> Trajectories:
    numbers = np.concatenate([np.asarray(share) for share in shares])
    return select(join(runs), np.argsort(numbers))


def _roll_out_share(plan: RunPlan, numbers: range, domain: int, index: int) -> Trajectories:
    """Run some of the episodes with one pair of processes."""
    os.environ["ROS_DOMAIN_ID"] = str(domain)
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    settle_memory()  # before the plant, which would else be kept for ever

    def progress(steps: int) -> None:
        _counts[index].value = steps

    group = ProcessGroup()
    try:
        rows = system_rows(replace(plan, supervised=True))
        group.start(rows["controller"])
        with supervisor(plan) as overseer:
            arguments = command_line(rows["plant"])[3:]
            plant = PlantNode(make_backend, lambda _code: None, cli_args=arguments)
            if plant.trigger_configure() != TransitionCallbackReturn.SUCCESS:
                raise RunFailed("the plant could not be configured")
            with spinning(plant, overseer.fail):
                return _episodes(plan, plant, overseer, group, numbers, progress)
    finally:
        group.stop_all()


def _episodes(
    plan: RunPlan,
    plant: PlantNode,
    overseer: Supervisor,
    group: ProcessGroup,
    numbers: range,
    progress: Progress,
) -> Trajectories:
    robot, scenario = load_robot(plan.robot), load_scenario(plan.scenario)
    task = evaluated_task(
        plan.task, thing=plan.thing, along=plan.along, episode_s=plan.duration_s, goals=plan.goals
    )
    control_dt = robot.timing.substeps(plan.control_hz) * robot.timing.physics_dt
    steps = episode_steps(task, control_dt)
    runs: list[Trajectories] = []
    log = TrajectoryLog(robot, task, control_dt)

    began = time.monotonic()

    def raise_if_ended() -> None:
        end = group.ended()
        if end is not None:
            raise RunFailed(f"{end.text}; its own words are above")

    def alive() -> None:
        raise_if_ended()
        if time.monotonic() - began > START_TIMEOUT_S:
            raise RunFailed(
                f"the controller did not take its goal within {START_TIMEOUT_S:g} s. Try `fulmar doctor`."
            )

    for done, number in enumerate(numbers, start=1):
        began = time.monotonic()
        episode = draw_episode(robot, task, scenario, seed=plan.seed, number=number)
        # The same instant twice would be the same goal: the clock moves on between episodes.
        plant.clock.advance(control_dt)
        counter = TargetCounter(task, episode.goal, control_dt)
        truths: list[State] = []
        goals: list[Goal] = []
        commands: list[np.ndarray] = []

        def on_step(
            sample: Sample,
            command: np.ndarray,
            counter: TargetCounter = counter,
            truths: list[State] = truths,
            goals: list[Goal] = goals,
            commands: list[np.ndarray] = commands,
        ) -> None:
            assert sample.truth is not None
            truths.append(task.state_type.from_rigid(sample.truth))
            goals.append(counter.update(truths[-1], sample.things))
            commands.append(np.array(command))

        with _goal_given(plan, episode, plant, overseer, group, alive):
            try:
                plant.run_episode(episode, number=number, seed=plan.seed, steps=steps, on_step=on_step)
            except LockstepError:
                raise_if_ended()  # a controller that has ended is a better reason than its silence
                raise
        log.add_episode(truths, goals, commands)
        runs.append(log.trajectories())
        progress(done * steps)
    return join(runs)


@contextlib.contextmanager
def _goal_given(
    plan: RunPlan, episode: Episode, plant: PlantNode, overseer: Supervisor, group: ProcessGroup, alive: Alive
) -> Iterator[None]:
    """While an episode lasts: the supervisor has given its goal, or a goal node publishes it with each odometry."""
    if not plan.goals:
        overseer.give_goal(episode.goal, time_ns=plant.clock.now_ns, alive=alive)
        yield
        return
    # A new node for each episode: it goes on along its path from where it was.
    spec = replace(run_goals_spec(plan), quiet=True)
    group.start(spec)
    try:
        while plant.wires.subscribers() < 2:
            alive()
            time.sleep(0.005)
        yield
    finally:
        group.stop(spec.name)
        while plant.wires.subscribers() > 1:
            alive()
            time.sleep(0.005)
