"""Closed loops in the core's batch whose valves or fans fail on the way, each watched by a `FaultMonitor`."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fulmar_core.control_loop import ControlLoop
from fulmar_core.disturbances.parts import Stuck
from fulmar_core.disturbances.scenario import Scenario, load_scenario
from fulmar_core.goal import goal_in_float64
from fulmar_core.health.applied import AppliedHistory
from fulmar_core.health.fault_monitor import FaultMonitor
from fulmar_core.health.losses import Losses
from fulmar_core.robot import load_robot
from fulmar_core.safety.convergence import ConvergenceMonitor
from fulmar_core.simulation import BatchSimulation
from fulmar_core.state import RigidBodyState
from fulmar_core.tasks import load_task
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


def watch(
    robot_name: str,
    task_name: str,
    controller: str,
    scenario: Scenario,
    *,
    episodes: int,
    seconds: float,
    seed: int = 0,
) -> list[Watched]:
    """Run episodes of a seed side by side."""
    robot, task = load_robot(robot_name), load_task(task_name)
    acts = load_controller(controller, robot, task, Choice(robot.timing.control_hz))
    batch = BatchSimulation(
        robot,
        task,
        scenario,
        worlds=episodes,
        seed=seed,
        control_hz=acts.control_hz,
        dtype=np.float64,
    )
    loop = ControlLoop(robot, task, acts, robots=episodes)
    loop.reset()
    loop.begin(goal_in_float64(batch.goal))
    hold_ns = round(2e9 * loop.dt)
    histories = [AppliedHistory(hold_ns) for _ in range(episodes)]
    monitors = [FaultMonitor(robot, each, control_hz=acts.control_hz, lockstep=True) for each in histories]
    named: list[tuple[dict[str, float], dict[str, float]]] = [({}, {}) for _ in range(episodes)]
    said: list[dict[str, None]] = [{} for _ in range(episodes)]
    at_goal: list[float | None] = [None] * episodes
    losses = [Losses(robot) for _ in range(episodes)]
    convergence, unconverged = ConvergenceMonitor(robot, loop.task, loop.dt), [None] * episodes
    for number in range(round(seconds / loop.dt)):
        time_s, stamp_ns = number * loop.dt, round(1e9 * number * loop.dt)
        measured = batch.measured.to_rigid()
        for i, monitor in enumerate(monitors):
            monitor.take(
                RigidBodyState(*(np.asarray(getattr(measured, part))[i] for part in PARTS)), stamp_ns
            )
            for names, known in zip((monitor.beliefs.dead, monitor.beliefs.open), named[i], strict=True):
                for name in names:
                    known.setdefault(name, time_s)
            said[i] |= dict.fromkeys(monitor.beliefs.words)
        inputs = loop.inputs(batch.measured, stamp_ns)
        step = loop.act(inputs)
        convergence.see(inputs.state, inputs.goal, step.command)
        suspected = np.array([bool(monitor.beliefs.dead) for monitor in monitors])
        late = convergence.late(suspected)
        for i, monitor in enumerate(monitors):
            late[i] |= losses[i].hopeless(monitor.beliefs.dead, stamp_ns)
        for i, stops in enumerate(late):
            unconverged[i] = time_s if stops and unconverged[i] is None else unconverged[i]
        for history, command in zip(histories, step.command, strict=True):
            history.add(stamp_ns, np.array(command, dtype=float))
        within = loop.task.tolerance.holds(loop.task.errors(batch.truth, loop.goal))
        for i, there in enumerate(np.asarray(within)):
            at_goal[i] = (time_s if at_goal[i] is None else at_goal[i]) if there else None
        batch.move(step.command)
    alive = np.asarray(batch.world.alive)
    parts = np.asarray(batch.world.stuck_part).astype(int)
    return [
        Watched(
            robot.actuators.names[parts[i]] if parts[i] >= 0 else "",
            float(np.asarray(batch.world.stuck_from)[i]),
            *named[i],
            tuple(said[i]),
            unconverged[i],
            at_goal[i],
            tuple(name for name, works in zip(robot.actuators.names, alive[:, i], strict=True) if not works),
        )
        for i in range(episodes)
    ]
