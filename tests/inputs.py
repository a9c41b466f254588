"""Inputs of controllers, for tests of one control step."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.estimators.actuator_health.actuator_estimator import ActuatorEstimate
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.state import State
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import Goal, goal_in_float64
from fulmar_core.tasks.observation import Observer


def inputs_at(
    robot: Robot,
    task: Task,
    state: State,
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
    one = state.mapped(lambda column: np.atleast_1d(np.asarray(column, dtype=float)))
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
    e = inputs.estimates
    estimates = (
        ActuatorEstimate(e.state[index], e.push[index], e.alive[index], e.health[index]) if e else None
    )
    return replace(
        inputs,
        state=inputs.state[index],
        goal=inputs.goal[index],
        observation=inputs.observation[index],
        previous=inputs.previous[index],
        estimates=estimates,
        readings={name: values[index] for name, values in inputs.readings.items()},
        believed=None if inputs.believed is None else inputs.believed[index],
    )
