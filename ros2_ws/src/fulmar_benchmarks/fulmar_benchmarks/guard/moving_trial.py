"""Runs of boats, wheels and wings with and without the envelope guard, in the core's batch."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fulmar_benchmarks.guard.moving_defects import DefectiveDriver
from fulmar_benchmarks.guard.trial import SOUND, THRUST, Trial, decision_figures, loaded, scenario_of
from fulmar_benchmarks.guard.wing_defects import DefectivePilot
from fulmar_core.controllers.controller import Controller
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.envelope.lean.guard import RolloutGuard
from fulmar_core.simulation.episode import draw_episodes
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import State
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.flight_terms import is_lost
from fulmar_core.tasks.goal import Goal, goal_in_float64
from fulmar_core.worlds.parts import Actuation
from fulmar_core.worlds.scenario import Scenario

SIDE_M, BOAT_SIDE_M = 2.5, 6.0  # half the area: of wheels, and of boats, which need some metres to stop [m]
DRAWN = 0.76  # of it, in which starts and goals are drawn [-]
FARTHEST_M = 5.0  # of goals from starts, as tasks draw them: policies know no farther ones [m]
WING_DELAY_S = 0.02  # of commands to aircraft, at most [s]
WING_RUN_S = 20.0  # shorter than those of others: what an aircraft loses it loses within seconds [s]


@dataclass(frozen=True)
class Field:
    """Where robots of one kind are kept, and what they do there.

    Attributes:
        robot: The robot.
        task: Its task.
        scenario: What worlds are drawn from.
        side: Half the area; 0: none, of aircraft [m].
    """

    robot: Robot
    task: Task
    scenario: Scenario
    side: float

    @property
    def area(self) -> tuple[float, ...]:
        """In the form of `check_area`."""
        return (-self.side, self.side) * 2  # without a side that of none

    def guard(self, control_hz: float) -> RolloutGuard:
        """The guard of this field."""
        return RolloutGuard(self.robot, control_hz, area=self.area)

    def defective(self, trial: Trial, sound: Controller) -> DefectiveDriver | DefectivePilot:
        """The controller of a trial, with its defect."""
        kind = DefectivePilot if self.robot.airframe is not None else DefectiveDriver
        return kind(trial.defect, sound, self.robot, self.task, count=trial.runs, seed=trial.seed)

    def beyond(self, truth: State) -> np.ndarray:
        """How far robots are beyond a side, or how deep in the water, negative inside, shape (n,) [m]."""
        place = truth.to_rigid().position_in_world
        if self.side:
            return np.asarray(np.abs(place[:, :2]).max(axis=1) - self.side)
        deep = -(place[:, 2] + self.robot.hull_span[0])
        lost = is_lost(SpatialState.from_rigid(truth.to_rigid()), self.robot)
        return np.asarray(np.where(lost, np.maximum(deep, 1e-3), deep))

    def arrived(self, truth: State, goal: Goal) -> np.ndarray:
        """Which robots are at their goals: within the task's tolerance; of aircraft across their flight."""
        axes = slice(0, 2) if self.side else slice(1, 3)
        place, aim = truth.to_rigid().position_in_world, np.asarray(goal.current)
        off = np.linalg.norm(place[:, axes] - aim[:, axes], axis=1)
        return np.asarray(off < self.task.tolerance.position)


def field_of(name: str) -> Field:
    """The field of a robot.

    Raises:
        ConfigError: There is no such robot.
    """
    robot = load_robot(name)
    if robot.airframe is not None:
        actuation = Actuation(gain=THRUST, delay_s=WING_DELAY_S)
        scenario = Scenario("identified", sensor_noise=True, body="uncertain", actuation=actuation)
        return Field(robot, load_task("fly_hold").fitted(robot), scenario, 0.0)
    side = SIDE_M if robot.hydrodynamics is None else BOAT_SIDE_M
    return Field(robot, load_task("go_to_position"), scenario_of(SOUND), side)


def drive(trial: Trial, progress: Callable[[float], None] = lambda share: None) -> dict[str, Any]:
    """Drive or fly the runs of a trial; result as in `trial.fly`."""
    field = field_of(trial.robot)
    robot, task = field.robot, field.task
    controller = field.defective(trial, loaded(trial, robot, task))
    envelope = field.guard(controller.control_hz) if trial.guarded else None
    loop = ControlLoop(robot, task, controller, robots=trial.runs, envelope=envelope)
    worlds = _worlds(trial, field, controller.control_hz)
    loop.reset()
    loop.begin(goal_in_float64(worlds.goal))
    steps = round(trial.seconds / loop.dt)
    worst, tripped = np.full(trial.runs, -np.inf), np.zeros(trial.runs, dtype=bool)
    for step in range(steps):
        done = loop.step(worlds.measured, worlds.readings, round(1e9 * step * loop.dt))
        worlds.move(done.command)
        worst = np.maximum(worst, field.beyond(worlds.truth))
        if envelope is not None:
            tripped |= envelope.trips > 0
        progress((step + 1) / steps)
    backup = 0.0 if envelope is None else envelope.steps_in_backup / envelope.steps
    return {
        "runs": trial.runs,
        "left": int((worst > 0.0).sum()),
        "worst_m": float(worst.max()),
        "trip_share": float(tripped.mean()),
        "backup_share": backup,
        "success": float((field.arrived(worlds.truth, worlds.goal) & (worst <= 0.0)).mean()),
    }


def _worlds(trial: Trial, field: Field, control_hz: float) -> BatchSimulation[Any]:
    """The worlds of a trial, with starts and goals inside the area."""
    robot, task = field.robot, field.task
    worlds: BatchSimulation[Any] = BatchSimulation(
        robot, task, field.scenario, worlds=trial.runs, seed=trial.seed, control_hz=control_hz
    )
    if not field.side:
        return worlds
    drawn = draw_episodes(
        robot, task.fitted(robot), field.scenario, seed=trial.seed, numbers=np.arange(trial.runs)
    )
    random, most = np.random.default_rng((trial.seed, 1)), DRAWN * field.side
    x, y = random.uniform(-most, most, (2, trial.runs))
    targets = np.array(drawn.goal.targets, dtype=float)
    offset = random.uniform(-most, most, (trial.runs, 2)) - np.stack((x, y), axis=-1)
    far = np.linalg.norm(offset, axis=1, keepdims=True)
    targets[:, 0, :2] = np.stack((x, y), axis=-1) + offset * np.minimum(1.0, FARTHEST_M / far)
    start = replace(drawn.start, x=x, y=y)
    worlds.put(start, replace(drawn.goal, targets=targets), worlds.command)
    return worlds


def decision_of(name: str, controller: str, seed: int, *, count: int = 300) -> dict[str, float]:
    """Processor time of a decision for one robot under way, guard and backup.

    Returns:
        As `decision_ms`.
    """
    field = field_of(name)
    trial = Trial(name, "none", guarded=True, runs=1, seed=seed, controller=controller)
    sound = field.defective(trial, loaded(trial, field.robot, field.task))
    envelope = field.guard(sound.control_hz)
    loop = ControlLoop(field.robot, field.task, sound, robots=1, envelope=envelope)
    worlds = _worlds(trial, field, sound.control_hz)
    loop.begin(goal_in_float64(worlds.goal))
    took = []
    for step in range(count):
        inputs = loop.inputs(worlds.measured, worlds.readings, round(1e9 * step * loop.dt))
        done = loop.act(inputs)
        began_ns = time.thread_time_ns()
        envelope.guarded(done.command, inputs)
        took.append((time.thread_time_ns() - began_ns) / 1e6)
        worlds.move(done.command)
    return decision_figures(took, loop.dt)
