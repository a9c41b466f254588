"""Inputs of controllers, for tests of one control step."""

from __future__ import annotations

from typing import Any

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.goal import Goal, goal_in_float64
from fulmar_core.health.actuator_estimator import ActuatorEstimate
from fulmar_core.observation import Observer
from fulmar_core.planar import COLUMNS, PlanarState
from fulmar_core.robot import Robot
from fulmar_core.simulation import BatchSimulation
from fulmar_core.tasks import Task


def inputs_at(
    robot: Robot,
    task: Task,
    state: PlanarState,
    goal: Goal,
    *,
    previous: Any = None,
    estimates: ActuatorEstimate | None = None,
    stamp_ns: int = 0,
) -> Inputs:
    """Inputs of robots in some states; one state, one goal and one previous command count for all of them.

    Args:
        robot: The robot.
        task: What it does.
        state: Shapes (n,), or () of one robot.
        goal: Leading shape (n,) or ().
        previous: Command of the step before, shape (n, m) or (m,); the safe one by default.
        estimates: Of an actuator estimator.
        stamp_ns: Of the measurement [ns].
    """
    one = PlanarState(*(np.atleast_1d(np.asarray(getattr(state, name), dtype=float)) for name in COLUMNS))
    count = len(one.x)
    goals = goal_in_float64(goal if np.ndim(goal.done) else goal[None])
    if len(goals.done) != count:
        goals = goals[np.zeros(count, dtype=int)]
    before = robot.actuators.safe_command if previous is None else previous
    commands = np.broadcast_to(np.asarray(before, dtype=float), (count, len(robot.actuators.names)))
    observation = np.asarray(Observer(robot, task)(one, goals, commands), dtype=float)
    dt = 1.0 / robot.timing.control_hz
    return Inputs(one, goals, observation, commands, estimates, stamp_ns, dt)


def inputs_of(simulation: BatchSimulation) -> Inputs:
    """Inputs of every world of a simulation, as measured now."""
    return inputs_at(
        simulation.robot,
        simulation.task,
        simulation.measured,
        simulation.goal,
        previous=simulation.command,
    )


def some_of(inputs: Inputs, index: Any) -> Inputs:
    """Inputs of some of the robots; an index that keeps the axis."""
    assert inputs.estimates is None
    parts = (inputs.state[index], inputs.goal[index], inputs.observation[index], inputs.previous[index])
    return Inputs(*parts, None, inputs.stamp_ns, inputs.dt)


def inputs_seeing(observations: Any) -> Inputs:
    """Inputs of which only the observation is known, shape (n, k) or (k,): enough for a network without estimates."""
    rows = np.atleast_2d(np.asarray(observations, dtype=float))
    unknown = np.full(len(rows), np.nan)
    goal = Goal(
        unknown[:, None, None].repeat(3, axis=-1),
        unknown,
        np.zeros((len(rows), 0, 3)),
        np.zeros((len(rows), 2)),
    )
    return Inputs(
        PlanarState(*(unknown for _ in COLUMNS)), goal, rows, np.zeros((len(rows), 0)), None, 0, np.nan
    )
