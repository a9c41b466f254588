"""Reward of a control step and the end of an episode: one rule for everyone who steps worlds."""

from __future__ import annotations

from array_api_compat import device

from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.arrays import array_namespace, is_numpy, sum_of
from fulmar_core.states.rotation import Array
from fulmar_core.states.state import State
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import Goal
from fulmar_core.tasks.observation import shares


def learning_step(
    robot: Robot,
    task: Task,
    *,
    before: State,
    after: State,
    goal: Goal,
    ended: Goal,
    previous: Array,
    command: Array,
    effort: float,
) -> tuple[Array, Array]:
    """Reward of one control step of some worlds, and whether it ends their episodes.

    Args:
        robot: Says what changing its commands costs, and how far off it may be.
        task: Says what the step is worth.
        before: True state when the step began, shapes (worlds,).
        after: When it ended.
        goal: What the step was for.
        ended: The goal after it.
        previous: Command of the step before, shape (worlds, n).
        command: Of this step.
        effort: What full command of one actuator costs, as `Costs.effort`.

    Returns:
        The reward, less what the actuators cost and what is in the way; and whether the episode is over before its
        time, because the robot left the geofence or touched something. Shapes (worlds,).
    """
    reward = task.reward(before, after, goal, ended) - _cost(robot, effort, previous, command)
    penalty = task.penalty(after, goal, robot)
    if penalty is not None:
        reward = reward - penalty
    xp = array_namespace(after.like)
    over = xp.zeros(after.like.shape, dtype=xp.bool, device=device(after.like))
    away = task.distance_from_goal(after, ended)
    if away is not None:
        over = away > robot.limits.geofence
    touching = task.collides(after, goal, robot)
    return reward, over if touching is None else over | touching


def observed_step(
    simulation: BatchSimulation, command: Array, *, effort: float
) -> tuple[Array, Array, Array]:
    """Move a batch one control step; return its reward, ends and observation.

    Args:
        simulation: The worlds.
        command: In the actuators' units, shape (worlds, n).
        effort: What full command of one actuator costs; the robot's own is `Costs.effort`.

    Returns:
        Reward and whether episodes are over, as `learning_step`, and what controllers see now, shape (worlds, k).
    """
    before, goal, previous = simulation.truth, simulation.goal, simulation.command
    simulation.step(command)
    reward, over = learning_step(
        simulation.robot,
        simulation.task,
        before=before,
        after=simulation.truth,
        goal=goal,
        ended=simulation.goal,
        previous=previous,
        command=simulation.command,
        effort=effort,
    )
    return reward, over, simulation.observe()


def _cost(robot: Robot, effort: float, previous: Array, command: Array) -> Array:
    """What using the actuators costs, shape (worlds,)."""
    scale = robot.actuators.scale
    share = shares(command, scale)
    cost = effort * _sum(array_namespace(share).abs(share))
    if robot.costs.change:
        change = share - shares(previous, scale)
        cost = cost + robot.costs.change * _sum(change * change)
    return cost


def _sum(rows: Array) -> Array:
    """Sum of each row, shape (worlds,)."""
    if not is_numpy(rows):
        return array_namespace(rows).sum(rows, axis=1)
    return sum_of([rows[:, i] for i in range(rows.shape[1])])
