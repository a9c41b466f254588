"""Closed loops whose valves or fans fail on the way, each watched by the guards of a controller node."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fulmar_core.controllers.controller import Controller
from fulmar_core.estimators.actuator_health.applied import AppliedHistory
from fulmar_core.estimators.actuator_health.fault_monitor import FaultMonitor
from fulmar_core.estimators.actuator_health.losses import Losses
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.convergence import ConvergenceMonitor
from fulmar_core.simulation.backend import Sample
from fulmar_core.simulation.episode import draw_episodes
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.worlds.parts import Stuck
from fulmar_core.worlds.scenario import Scenario, load_scenario
from policy_server.controllers import Choice, load_controller

PARTS = ("position_in_world", "quat_xyzw", "velocity_in_world", "angular_velocity_in_body")
OPEN, HALF, CLOSED = 1.0, 0.5, 0.0


@dataclass(frozen=True)
class Watched:
    """What became of one episode.

    Attributes:
        part: Name of the actuator that stuck; empty if none did.
        from_s: When it did [s].
        dead: When each actuator was first named as dead, by its name [s].
        open: Same as stuck open.
        said: Everything that was said, each once.
        unconverged_s: When it was found not to converge; None if it was not [s].
        lost: Names of actuators that were dead from the start, as the scenario drew.
        at_goal_s: Since when the robot is at its target in the end; None if it is not [s].
    """

    part: str
    from_s: float
    dead: dict[str, float]
    open: dict[str, float]
    said: tuple[str, ...]
    unconverged_s: float | None
    at_goal_s: float | None
    lost: tuple[str, ...] = ()

    @property
    def stopped_s(self) -> float | None:
        """When the controller would have stopped, in words; None if it would not [s]."""
        stops = [*self.open.values(), *([] if self.unconverged_s is None else [self.unconverged_s])]
        return min(stops, default=None)

    def right(self, at: float) -> bool:
        """Whether the part that sticks there was named."""
        return self.part in (self.dead if at == CLOSED else self.open)

    def wrong(self, at: float | None) -> list[str]:
        """Names that should not have been named, of a part that sticks there; None: none does."""
        dead, opened = set(self.dead) - set(self.lost), set(self.open)
        if at is not None:
            (dead if at == CLOSED else opened).discard(self.part)
        return sorted(dead | opened)


def sticking(at: float, *, from_s: tuple[float, float] = (1.0, 4.0), scenario: str = "nominal") -> Scenario:
    """A scenario in which one of the robot's valves or fans sticks as well."""
    stuck = Stuck(("*",), at, from_s)
    usual = load_scenario(scenario)
    return replace(usual, actuation=replace(usual.actuation, stuck=stuck))


class Simulators:
    """MuJoCo side by side, with what `watch` needs of a `BatchSimulation`."""

    def __init__(
        self, robot: Robot, task: Task, scenario: Scenario, *, worlds: int, seed: int, control_hz: float
    ) -> None:
        from sim_nodes.mujoco_backend import MujocoBackend

        task = task.fitted(robot)
        self._form, self._ticks = task.state_type, robot.timing.substeps(control_hz)
        drawn = draw_episodes(robot, task, scenario, seed=seed, numbers=np.arange(worlds))
        self.goal, self.world = drawn.goal, drawn.world
        self._backends = [MujocoBackend.of(robot, task, scenario) for _ in range(worlds)]
        self._take([each.reset(drawn[i], seed=seed, number=i) for i, each in enumerate(self._backends)])

    def move(self, commands: np.ndarray) -> None:
        """Apply one command each for one control step."""
        self._take(
            [each.step(command, self._ticks) for each, command in zip(self._backends, commands, strict=True)]
        )

    def _take(self, samples: list[Sample]) -> None:
        form = self._form
        self.measured = form.stack([form.from_rigid(sample.measured) for sample in samples])
        self.truth = form.stack([form.from_rigid(sample.truth) for sample in samples])


def in_core(
    robot: Robot, task: Task, scenario: Scenario, *, worlds: int, seed: int, control_hz: float
) -> BatchSimulation[Any]:
    """The core's batch."""
    return BatchSimulation(
        robot, task, scenario, worlds=worlds, seed=seed, control_hz=control_hz, dtype=np.float64
    )


class Watching:
    """What the guards of one robot's controller node say of it, step by step."""

    def __init__(self, robot: Robot, controller: Controller) -> None:
        control_hz = controller.control_hz
        self._knows = controller.estimator is not None  # which actuators work
        self._applied = AppliedHistory(round(2e9 / control_hz))
        self._monitor = FaultMonitor(robot, self._applied, control_hz=control_hz, lockstep=True)
        self._losses = Losses(robot)
        self.dead: dict[str, float] = {}
        self.open: dict[str, float] = {}
        self.said: dict[str, None] = {}
        self.unconverged_s: float | None = None
        self.at_goal_s: float | None = None
        self.hopeless = False

    def see(self, state: RigidBodyState, stamp_ns: int) -> None:
        """Take a measurement."""
        self._monitor.take(state, stamp_ns)
        beliefs = self._monitor.beliefs
        for names, known in ((beliefs.dead, self.dead), (beliefs.open, self.open)):
            for name in names:
                known.setdefault(name, 1e-9 * stamp_ns)
        self.said |= dict.fromkeys(beliefs.words)
        self.hopeless = not self._knows and self._losses.hopeless(beliefs.dead, stamp_ns)

    def follow(self, command: np.ndarray, stamp_ns: int, *, late: bool, there: bool) -> None:
        """Take what is applied from now on, whether it is late, and whether the robot is at its goal."""
        self._applied.add(stamp_ns, np.array(command, dtype=float))
        now_s = 1e-9 * stamp_ns
        if (late or self.hopeless) and self.unconverged_s is None:
            self.unconverged_s = now_s
        if not there:
            self.at_goal_s = None
        elif self.at_goal_s is None:
            self.at_goal_s = now_s


def watch(
    robot_name: str,
    task_name: str,
    controller: str,
    scenario: Scenario,
    *,
    episodes: int,
    seconds: float,
    seed: int = 0,
    simulator: Callable[..., Any] = in_core,
) -> list[Watched]:
    """Run episodes of a seed side by side."""
    robot, task = load_robot(robot_name), load_task(task_name)
    acts = load_controller(controller, robot, task, Choice(robot.timing.control_hz))
    worlds = simulator(robot, task, scenario, worlds=episodes, seed=seed, control_hz=acts.control_hz)
    loop = ControlLoop(robot, task, acts, robots=episodes)
    loop.reset()
    loop.begin(goal_in_float64(worlds.goal))
    convergence = ConvergenceMonitor(robot, loop.task, loop.dt)
    watched = [Watching(robot, acts) for _ in range(episodes)]
    for number in range(round(seconds / loop.dt)):
        stamp_ns = round(1e9 * number * loop.dt)
        measured = worlds.measured.to_rigid()
        for i, each in enumerate(watched):
            each.see(RigidBodyState(*(np.asarray(getattr(measured, part))[i] for part in PARTS)), stamp_ns)
        inputs = loop.inputs(worlds.measured, {}, stamp_ns)
        commands = loop.act(inputs).command
        late = convergence.see(inputs.state, inputs.goal, commands)
        there = np.asarray(loop.task.tolerance.holds(loop.task.errors(worlds.truth, loop.goal)))
        for i, each in enumerate(watched):
            each.follow(commands[i], stamp_ns, late=bool(late[i]), there=bool(there[i]))
        worlds.move(commands)
    names, alive = robot.actuators.names, np.asarray(worlds.world.alive)
    parts, from_s = np.asarray(worlds.world.stuck_part).astype(int), np.asarray(worlds.world.stuck_from)
    if alive.shape[0] != len(names):
        alive = alive.T
    return [
        Watched(
            names[parts[i]] if parts[i] >= 0 else "",
            float(from_s[i]),
            each.dead,
            each.open,
            tuple(each.said),
            each.unconverged_s,
            each.at_goal_s,
            tuple(name for name, works in zip(names, alive[:, i], strict=True) if not works),
        )
        for i, each in enumerate(watched)
    ]
