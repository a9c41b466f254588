"""Inputs of a control step that tests begin from."""

from __future__ import annotations

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.goal import Goal, goal_in_float64, stack_goals
from fulmar_core.health.actuator_estimator import ActuatorEstimate
from fulmar_core.observation import Observer
from fulmar_core.planar import COLUMNS, PlanarState
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task, fitted


def inputs_at(
    robot: Robot,
    task: Task,
    state: PlanarState,
    goal: Goal,
    *,
    previous: np.ndarray | None = None,
    estimates: ActuatorEstimate | None = None,
) -> Inputs:
    """Inputs of n robots in given states.

    Args:
        robot: The robot.
        task: What it does.
        state: As measured, shapes (n,), or () for one robot.
        goal: Of the same leading shape, or one for all.
        previous: Command before, shape (n, m); the safe one by default.
        estimates: Of the same robots.
    """
    parts = (np.atleast_1d(np.asarray(getattr(state, name), dtype=float)) for name in COLUMNS)
    state = PlanarState(*np.broadcast_arrays(*parts))
    n = len(state.x)
    goal = goal_in_float64(goal if np.ndim(goal.done) else stack_goals([goal] * n))
    if previous is None:
        previous = np.tile(np.asarray(robot.actuators.safe_command, dtype=float), (n, 1))
    observation = np.asarray(Observer(robot, fitted(task, robot))(state, goal, previous), dtype=float)
    return Inputs(state, goal, observation, previous, estimates, 0, 1.0 / robot.timing.control_hz)


def inputs_seeing(observations: np.ndarray) -> Inputs:
    """Inputs of which only the observation is known, shape (n, k) or (k,): enough for a network without estimates."""
    rows = np.atleast_2d(np.asarray(observations, dtype=float))
    unknown = np.full(len(rows), np.nan)
    goal = Goal(
        np.full((len(rows), 1, 3), np.nan), unknown, np.zeros((len(rows), 0, 3)), np.zeros((len(rows), 2))
    )
    state = PlanarState(*(unknown for _ in COLUMNS))
    return Inputs(state, goal, rows, np.zeros((len(rows), 0)), None, 0, np.nan)
