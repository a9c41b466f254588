"""How far simulators part under the same commands: a controller drives the core, the others repeat what it gave."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fulmar_core.config.errors import SafetyError
from fulmar_core.controllers.controller import Controller
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.backend import Backend, Sample
from fulmar_core.simulation.episode import Episode, draw_episodes
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.worlds.scenario import Scenario

QUANTITIES = ("position_m", "attitude_deg", "velocity_m_s", "turn_rate_deg_s")


@dataclass(frozen=True)
class Motion:
    """True states of some runs at the end of each control step; NaN after a simulator has lost its state."""

    position: np.ndarray  # (steps, runs, 3) in the world [m]
    quat: np.ndarray  # (steps, runs, 4) x, y, z, w
    velocity: np.ndarray  # (steps, runs, 3) in the world [m/s]
    turn_rate: np.ndarray  # (steps, runs, 3) in the body [rad/s]

    @classmethod
    def of(cls, states: Sequence[RigidBodyState]) -> Motion:
        """Of the states of all runs at each step, shapes (runs, ...)."""
        return cls(
            np.stack([np.asarray(state.position_in_world, dtype=float) for state in states]),
            np.stack([np.asarray(state.quat_xyzw, dtype=float) for state in states]),
            np.stack([np.asarray(state.velocity_in_world, dtype=float) for state in states]),
            np.stack([np.asarray(state.angular_velocity_in_body, dtype=float) for state in states]),
        )


@dataclass(frozen=True)
class CoreRuns:
    """Runs of a controller in the core, with what the others need to repeat them."""

    drawn: Episode  # of all runs
    commands: np.ndarray  # (steps, runs, n) within every limit
    motion: Motion
    seed: int
    substeps: int  # physics steps of a command
    dt: float  # of a control step [s]


def run_in_core(
    controller: Controller,
    robot: Robot,
    task: Task,
    scenario: Scenario,
    *,
    runs: int,
    seed: int,
    steps: int,
) -> CoreRuns:
    """Drive a robot by a controller in the core's batch, in double precision.

    Args:
        controller: The controller.
        robot: The robot.
        task: The task.
        scenario: What the episodes are drawn from.
        runs: Number of episodes, >= 1.
        seed: Of the episodes.
        steps: Control steps of each, >= 1.
    """
    world = BatchSimulation(
        robot, task, scenario, worlds=runs, seed=seed, control_hz=controller.control_hz, dtype=np.float64
    )
    loop = ControlLoop(robot, task, controller, robots=runs)
    loop.reset()
    loop.begin(goal_in_float64(world.goal))
    commands, states = [], []
    for number in range(steps):
        assert loop.goal is not None
        loop.goal = goal_in_float64(loop.goal.among(world.things))
        step = loop.step(world.measured, world.readings, round(1e9 * number * loop.dt))
        world.move(step.command)
        commands.append(np.array(step.command, dtype=float))
        states.append(world.truth.to_rigid())
    drawn = draw_episodes(robot, task.fitted(robot), scenario, seed=seed, numbers=np.arange(runs))
    return CoreRuns(drawn, np.stack(commands), Motion.of(states), seed, world.substeps, world.control_dt)


def repeat_in(
    make_backend: Callable[[], Backend], core: CoreRuns, progress: Callable[[int], None] = lambda steps: None
) -> Motion:
    """Repeat the commands of the core in another simulator, run by run, from the same starts in the same worlds.

    Args:
        make_backend: Builds the simulator.
        core: The runs.
        progress: Receives the number of control steps done.
    """
    steps, runs = core.commands.shape[:2]
    backend = make_backend()
    by_run: list[list[RigidBodyState]] = []
    try:
        for run in range(runs):
            backend.reset(core.drawn[run], seed=core.seed, number=run)
            by_run.append([])
            for number in range(steps):
                by_run[-1].append(_step(backend, core.commands[number, run], core.substeps))
                if by_run[-1][-1] is LOST:
                    by_run[-1] += [LOST] * (steps - number - 1)
                    break
            progress((run + 1) * steps)
    finally:
        backend.close()
    return Motion.of([_joined([states[number] for states in by_run]) for number in range(steps)])


LOST = RigidBodyState(*(np.full(n, np.nan) for n in (3, 4, 3, 3)))


def _step(backend: Backend, command: np.ndarray, substeps: int) -> RigidBodyState:
    """The true state after a command; `LOST` once it is not finite."""
    try:
        sample: Sample = backend.step(command, substeps)
    except SafetyError:
        return LOST
    return LOST if sample.truth is None else sample.truth


def _joined(states: Sequence[RigidBodyState]) -> RigidBodyState:
    parts = ("position_in_world", "quat_xyzw", "velocity_in_world", "angular_velocity_in_body")
    return RigidBodyState(*(np.stack([getattr(state, part) for state in states]) for part in parts))


def divergence(ours: Motion, theirs: Motion) -> dict[str, np.ndarray]:
    """Distance of two motions by `QUANTITIES`, shapes (steps, runs) [m, deg, m/s, deg/s]."""
    # |q - p| = 2 sin(angle / 4) for the nearer of p and -p: exact near 0, where the arc cosine of q·p is not.
    apart, beyond = (np.linalg.norm(theirs.quat - sign * ours.quat, axis=-1) for sign in (1.0, -1.0))
    angle = 4.0 * np.arcsin(np.clip(0.5 * np.minimum(apart, beyond), 0.0, 1.0))
    return {
        "position_m": np.linalg.norm(theirs.position - ours.position, axis=-1),
        "attitude_deg": np.degrees(angle),
        "velocity_m_s": np.linalg.norm(theirs.velocity - ours.velocity, axis=-1),
        "turn_rate_deg_s": np.degrees(np.linalg.norm(theirs.turn_rate - ours.turn_rate, axis=-1)),
    }


def noise_of(robot: Robot) -> dict[str, float]:
    """Standard deviations of one reading of the robot's odometry, by `QUANTITIES`; 0: it is exact."""
    odometry = robot.sensors.odometry
    return {
        "position_m": odometry.position.std,
        "attitude_deg": float(np.degrees(odometry.heading.std)),
        "velocity_m_s": odometry.velocity.std,
        "turn_rate_deg_s": float(np.degrees(odometry.yaw_rate.std)),
    }
