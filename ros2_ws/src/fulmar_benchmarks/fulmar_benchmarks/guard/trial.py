"""Runs of floating robots in an area, with and without the envelope guard, in the core's batch or in MuJoCo."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fulmar_benchmarks.guard.defects import Defective
from fulmar_core.controllers.controller import Controller
from fulmar_core.estimators.actuator_health.actuator_estimator import ActuatorEstimator
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.loop.rollout import SteppedBackends
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.envelope.guard import EnvelopeGuard
from fulmar_core.simulation.backend import Backend, Sample
from fulmar_core.simulation.episode import Episode, draw_episodes
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.worlds.parts import Actuation, Push, Sensing
from fulmar_core.worlds.scenario import Scenario
from policy_server.controllers import Choice as ControllerChoice
from policy_server.controllers import load_controller, usual_hz

SIDE_M, DRAWN_M = 2.5, 1.9  # half the area, and half of where starts and goals are drawn [m]
BATCH, MUJOCO = WAYS = ("batch", "mujoco")
NEAR_M = 0.1  # from the goal, at the end, which counts as success [m]
# A body that was identified; see `fulmar_core.safety.envelope.braking.Beliefs`.
MASS, INERTIA = 0.05, 0.18  # largest share by which it differs from the file
PUSH, THRUST, DELAY_S = Push(force=0.1, torque=0.05), (0.9, 1.0), 0.06
# What is wrong with the beliefs: thrust, delay of commands, a dead valve, odometry that is late by a step.
SOUND, WEAK, SLOW, DEAD, LATE = BELIEFS = ("sound", "thrust", "delay", "dead", "late")


@dataclass(frozen=True)
class Trial:
    """Some runs.

    Attributes:
        robot: Its name.
        defect: One of `DEFECTS`.
        guarded: Whether the guard is on.
        runs: How many.
        seed: Of everything drawn.
        way: One of `WAYS`.
        belief: One of `BELIEFS`.
        controller: What has the defect.
        seconds: Length of each run [s].
    """

    robot: str
    defect: str
    guarded: bool
    runs: int
    seed: int
    way: str = BATCH
    belief: str = SOUND
    controller: str = "policy"
    seconds: float = 60.0


def identified(robot: Robot) -> Robot:
    """A robot that is uncertain as one whose body was identified."""
    mass, inertia = robot.body.mass, robot.body.inertia[2]
    spans = replace(
        robot.uncertainty,
        mass=((1.0 - MASS) * mass, (1.0 + MASS) * mass),
        yaw_inertia=((1.0 - INERTIA) * inertia, (1.0 + INERTIA) * inertia),
        center_of_mass=0.0,
    )
    return replace(robot, uncertainty=spans)


def scenario_of(belief: str) -> Scenario:
    """What worlds are drawn from, by what is wrong with the guard's beliefs."""
    actuation, sensing = Actuation(gain=THRUST, delay_s=DELAY_S), Sensing()
    if belief == WEAK:
        actuation = replace(actuation, gain=(0.6, 0.6))
    elif belief == SLOW:
        actuation = replace(actuation, delay_s=DELAY_S + 0.1, least_delay=1.0)
    elif belief == DEAD:
        actuation = replace(actuation, failures=1, failure_chance=1.0)
    elif belief == LATE:
        sensing = replace(sensing, delay_s=0.2, least_delay=1.0)
    return Scenario(
        "identified", sensor_noise=True, body="uncertain", push=PUSH, actuation=actuation, sensing=sensing
    )


def loaded(trial: Trial, robot: Robot, task: Task) -> Controller:
    """The controller without its defect.

    Raises:
        ConfigError: No policy is shipped for the pair, or the controller does not exist.
    """
    hz = usual_hz(trial.controller, robot, task)
    return load_controller(trial.controller, robot, task, ControllerChoice(hz))


def fly(trial: Trial, progress: Callable[[float], None] = lambda share: None) -> dict[str, Any]:
    """Fly the runs of a trial.

    Returns:
        `left`, how many left the area; `worst_m`, the farthest beyond a side; `trip_share` of the runs, `backup_share`
        of their time, and `success`, the share that never left and is at its goal at the end: a robot
        with an area that left it stays stopped.
    """
    robot = identified(load_robot(trial.robot))
    task = load_task("go_to_pose" + robot.state_type.SUFFIX)
    controller = Defective(
        trial.defect, loaded(trial, robot, task), robot, task, count=trial.runs, seed=trial.seed
    )
    episodes = _episodes(trial, robot, task)
    envelope = None
    if trial.guarded:
        area = (-SIDE_M, SIDE_M) * robot.state_type.AXES
        envelope = EnvelopeGuard(robot, controller.control_hz, area=area)
    loop = ControlLoop(robot, task, controller, robots=trial.runs, envelope=envelope)
    with ExitStack() as stack:
        worlds = _worlds(trial, robot, task, episodes, controller, stack)
        loop.reset()
        loop.begin(goal_in_float64(episodes.goal))
        steps = round(trial.seconds / loop.dt)
        axes = robot.state_type.AXES
        worst, tripped = np.full(trial.runs, -np.inf), np.zeros(trial.runs, dtype=bool)
        for step in range(steps):
            done = loop.step(worlds.measured, worlds.readings, round(1e9 * step * loop.dt))
            worlds.move(done.command)
            place = worlds.truth.to_rigid().position_in_world[:, :axes]
            worst = np.maximum(worst, np.abs(place).max(axis=1) - SIDE_M)
            if envelope is not None:
                tripped |= envelope.trips > 0
            progress((step + 1) / steps)
    aim = np.asarray(episodes.goal.current)[:, :axes]
    arrived = np.linalg.norm(place - aim, axis=1) < NEAR_M
    backup = 0.0 if envelope is None else envelope.steps_in_backup / envelope.steps
    return {
        "runs": trial.runs,
        "left": int((worst > 0.0).sum()),
        "worst_m": float(worst.max()),
        "trip_share": float(tripped.mean()),
        "backup_share": backup,
        "success": float((arrived & (worst <= 0.0)).mean()),
    }


def decision_ms(robot_name: str, controller: str, seed: int, *, count: int = 600) -> dict[str, float]:
    """Processor time of a decision of the guard for one robot under way, with the estimate that its backup needs.

    Returns:
        `p50` and `p99` of this thread, and the control `period` [ms].
    """
    robot = identified(load_robot(robot_name))
    task = load_task("go_to_pose" + robot.state_type.SUFFIX)
    trial = Trial(robot_name, "none", guarded=True, runs=1, seed=seed, controller=controller)
    area = (-SIDE_M, SIDE_M) * robot.state_type.AXES
    envelope = EnvelopeGuard(robot, robot.timing.control_hz, area=area)
    law = envelope.backup.law
    estimator = None if law.estimator is None else ActuatorEstimator(robot, law.estimator)
    loop = ControlLoop(robot, task, law)
    simulation = BatchSimulation(
        robot, task, scenario_of(SOUND), worlds=1, seed=seed, control_hz=law.control_hz
    )
    episodes = _episodes(trial, robot, task)
    simulation.put(episodes.start, episodes.goal, simulation.command)
    loop.begin(goal_in_float64(episodes.goal))
    took = []
    for step in range(count):
        inputs = loop.inputs(simulation.measured, simulation.readings, round(1e9 * step * loop.dt))
        command = loop.act(inputs).command
        state: Any = inputs.state
        began_ns = time.thread_time_ns()
        estimate = None if estimator is None else estimator.update(state, inputs.previous, loop.dt)
        envelope.guarded(command, inputs, estimate)
        took.append((time.thread_time_ns() - began_ns) / 1e6)
        simulation.move(command)
    return decision_figures(took, loop.dt)


def decision_figures(took: list[float], period_s: float) -> dict[str, float]:
    """What `decision_ms` returns, from the times of all decisions [ms] and the control period [s]."""
    p50, p99 = (float(np.percentile(took, share)) for share in (50, 99))
    return {"p50": p50, "p99": p99, "period": 1e3 * period_s}


def _episodes(trial: Trial, robot: Robot, task: Task) -> Episode[Any]:
    """Episodes with starts and goals inside the area, shape (runs,)."""
    drawn = draw_episodes(
        robot, task.fitted(robot), scenario_of(trial.belief), seed=trial.seed, numbers=np.arange(trial.runs)
    )
    axes, random = robot.state_type.AXES, np.random.default_rng((trial.seed, 1))
    places = random.uniform(-DRAWN_M, DRAWN_M, (axes, trial.runs))
    targets = np.array(drawn.goal.targets, dtype=float)
    targets[:, 0, :axes] = random.uniform(-DRAWN_M, DRAWN_M, (trial.runs, axes))
    start = replace(drawn.start, **dict(zip("xyz", places, strict=False)))
    return replace(drawn, start=start, goal=replace(drawn.goal, targets=targets))


def _worlds(
    trial: Trial, robot: Robot, task: Task, episodes: Episode[Any], controller: Controller, stack: ExitStack
) -> Any:
    """The worlds of a trial, as `SteppedBackends` has them."""
    scenario = scenario_of(trial.belief)
    if trial.way == BATCH:
        simulation: Any = BatchSimulation(
            robot, task, scenario, worlds=trial.runs, seed=trial.seed, control_hz=controller.control_hz
        )
        simulation.put(episodes.start, episodes.goal, simulation.command)
        return simulation
    from sim_nodes.mujoco_backend import MujocoBackend

    backends: list[Backend] = []
    samples: list[Sample] = []
    for number in range(trial.runs):
        backend = MujocoBackend.of(robot, task, scenario)
        stack.callback(backend.close)
        backends.append(backend)
        samples.append(backend.reset(episodes[number], seed=trial.seed, number=number))
    return SteppedBackends(backends, samples, controller, task)
