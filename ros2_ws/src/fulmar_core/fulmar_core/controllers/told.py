"""What a network may be told beside the observation: what pushes the robot, and which valves are dead.

Both are estimates from the observations and the network's own commands (`Watch`), so that nothing more has to come over
the wires. A feed-forward network cannot estimate them by itself, and without them it leans into every push.
"""

from __future__ import annotations

import numpy as np

from fulmar_core.controllers.seen import Reader
from fulmar_core.controllers.situation import Situation, Watch
from fulmar_core.goal import Goal, no_obstacles
from fulmar_core.health.applied import Applied
from fulmar_core.health.suspicion import Suspicion
from fulmar_core.health.thruster_health import Health, can_be_watched
from fulmar_core.observation import Observer
from fulmar_core.planar import PlanarState, to_body
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task

PUSH_TERMS = ("push_x_in_body", "push_y_in_body", "push_torque")  # [N, N, N·m]


def told_terms(robot: Robot) -> tuple[str, ...]:
    """Names of what is told: the push, and 1 for each valve, or 0 where it is dead; none of robots without valves."""
    if not can_be_watched(robot):
        return ()
    return (*PUSH_TERMS, *(f"{name}_alive" for name in robot.actuators.names))


class Told:
    """Observations of a robot at a task, completed by what is estimated from them.

    Where a pose is the goal, the terms of the task are computed anew from the estimated motion: a measured velocity is
    blurred by ten times as much.
    """

    def __init__(self, robot: Robot, task: Task, control_hz: float) -> None:
        """Build the estimator; rate of the observations in Hz."""
        self._task, reader = task, Reader(robot, task)
        self._estimates_pose = reader.heads and not (reader.tracks or reader.passes)
        # Networks learn on an estimator that takes no body for held and has no valve tried again.
        self._watch = Watch(robot, reader, Suspicion(held=0.0, retry_s=0.0), 1.0 / control_hz)

    def reset(self) -> None:
        """Forget everything."""
        self._watch.reset()

    def complete(self, observations: np.ndarray) -> np.ndarray:
        """Take observations, shape (rows, n), and append `told_terms`; another number of rows begins anew."""
        situation = self._watch.look(np.asarray(observations, dtype=float))
        assert situation.alive is not None
        terms = self._task.observe(*_seen_from_goal(situation)) if self._estimates_pose else ()
        return np.column_stack((*terms, observations[:, len(terms) :], situation.push, situation.alive))

    def acts(self, commands: np.ndarray) -> None:
        """Hear what is commanded until the next observations, shape (rows, valves)."""
        self._watch.acts(np.asarray(commands, dtype=float))

    def see_applied(self, applied: Applied | None) -> None:
        """See `ActuatorObserver`."""
        self._watch.see_applied(applied)

    @property
    def health(self) -> Health | None:
        """What is believed of valves and push; None before the first observation."""
        return self._watch.health


def _seen_from_goal(situation: Situation) -> tuple[PlanarState, Goal]:
    """The state in a world whose origin is the goal, shapes (rows,)."""
    yaw = -situation.turn
    x, y = to_body(-yaw, -situation.goal[0], -situation.goal[1])
    vx, vy = to_body(-yaw, situation.motion[0], situation.motion[1])
    rows = len(yaw)
    goal = Goal(np.zeros((rows, 1, 3)), np.zeros(rows), no_obstacles(rows), np.zeros((rows, 2)))
    return PlanarState(x, y, yaw, vx, vy, situation.motion[2]), goal


def told_for(robot: Robot, task: Task, control_hz: float, inputs: int) -> Told | None:
    """What completes observations for a network with so many inputs; None if it takes them as they are."""
    names = Observer(robot, task).names
    more = told_terms(robot)
    return Told(robot, task, control_hz) if more and inputs == len(names) + len(more) else None
