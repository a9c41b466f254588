"""A goal of an action client on its way: the target that counts, how far the robot is, and whether it has arrived.

Knows no ROS. Targets are poses of the task's own form, in the frame `odom`.
"""

from __future__ import annotations

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.states.state import RigidBodyState, State
from fulmar_core.tasks.goal import PLACES, Goal, stack_goals
from fulmar_core.tasks.task import Task

PATH = "goal_path"  # topic of goals that are waypoints
HOLD_S = 0.5  # within the tolerance of the last target, before a goal is met: a robot that rushes through is not there
PASSED_M = 0.25  # of a target that another one follows; a task with a wider tolerance has its own
AHEAD_M = 0.5  # along a path, of the point that a robot follows; at least two tolerances


def checked_task(task: Task) -> Task:
    """A task that action clients can give goals to: places, or waypoints, of which it then gets one at a time.

    Raises:
        ConfigError: Its goals are no places of the robot.
    """
    waypoints = task.goal_topic == PATH and task.required is not None
    if (task.goal_topic in PLACES or waypoints) and task.subject == "robot":
        return task
    topic = f"takes goals on '{task.goal_topic}'"
    why = f"is about the {task.subject}" if task.goal_topic in PLACES else topic
    raise ConfigError(
        f"task '{task.name}' {why}; an action client gives places of the robot. "
        "Take a task that goes to one, such as go_to_pose, go_to_position or go_to_pose_3d, or through several, "
        "such as go_through_poses."
    )


class Pursuit:
    """Targets of one goal, one after another or along a path.

    A goal's places are passed within `PASSED_M`, whatever the heading. The last one counts as the task says, for
    `HOLD_S`. Of a path, the target is the point that lies `AHEAD_M` ahead of where the robot is along it.

    Attributes:
        reached: Whether the last target was held.
        remaining_m: Way to the last target through all that are left [m]; infinite before the first state.
        speed: Of the newest state [m/s].
    """

    def __init__(self, robot: Robot, task: Task, targets: np.ndarray, *, follows: bool = False) -> None:
        """Begin at the first target.

        Args:
            robot: The robot.
            task: Whose tolerance counts; its goals are places.
            targets: Poses in the world, shape (k, 7), k >= 1.
            follows: Whether they are points of a path.
        """
        self._task: Task = task.fitted(robot)
        self._form: type[State] = task.state_type
        self._targets, self._follows = np.asarray(targets, dtype=float), follows
        within = self._task.tolerance.position
        self._passed_m, self._ahead_m = max(PASSED_M, within), max(AHEAD_M, 2.0 * within)
        places = self._targets[:, : self._form.AXES]
        steps = np.linalg.norm(np.diff(places, axis=0), axis=-1)
        self._along_m = np.concatenate(([0.0], np.cumsum(steps)))  # (k,) length of the path up to each target
        self._at_m = 0.0  # how far the robot has come along the path
        self._index = 0
        self._within_since_s: float | None = None
        self.reached, self.remaining_m, self.speed = False, np.inf, 0.0

    @property
    def left(self) -> int:
        """Targets that are not passed yet, the current one among them."""
        return len(self._targets) - self._index

    @property
    def target(self) -> np.ndarray:
        """Pose that counts now, shape (1, 7)."""
        if not self._follows:
            return np.array(self._targets[self._index : self._index + 1])
        ahead_m = min(self._at_m + self._ahead_m, float(self._along_m[-1]))
        after = min(int(np.searchsorted(self._along_m, ahead_m, side="left")), len(self._targets) - 1)
        target = np.array(self._targets[after])
        if after and self._along_m[after] > self._along_m[after - 1]:
            span = self._along_m[after] - self._along_m[after - 1]
            share = (ahead_m - self._along_m[after - 1]) / span
            before = self._targets[after - 1]
            target[:3] = before[:3] + share * (target[:3] - before[:3])
        return target[None]

    def see(self, state: RigidBodyState, time_s: float) -> None:
        """Take a measured state of a time [s], which never goes back."""
        place = np.asarray(state.position_in_world)[: self._form.AXES]
        self.speed = float(np.linalg.norm(state.velocity_in_world))
        if self._follows:
            self._advance_along(place)
        elif self.left > 1 and self._distance(place, self._index) <= self._passed_m:
            self._index += 1
        rest_m = float(self._along_m[-1] - self._along_m[self._index])
        self.remaining_m = self._distance(place, self._index) + rest_m
        if not (self.left == 1 and self._is_within(state)):
            self._within_since_s = None
        elif self._within_since_s is None:
            self._within_since_s = time_s
        self.reached = self._within_since_s is not None and time_s - self._within_since_s >= HOLD_S

    def _advance_along(self, place: np.ndarray) -> None:
        """Move along the path to the point nearest to a place, at most as far ahead as the target lies."""
        places = self._targets[:, : self._form.AXES]
        most_m, best_m, least = self._at_m + self._ahead_m, self._at_m, np.inf
        for number in range(len(places) - 1):
            begin_m, end_m = self._along_m[number], self._along_m[number + 1]
            if end_m < self._at_m or begin_m > most_m or end_m == begin_m:
                continue
            way = (places[number + 1] - places[number]) / (end_m - begin_m)
            low, high = max(begin_m, self._at_m), min(end_m, most_m)
            here_m = float(np.clip(begin_m + (place - places[number]) @ way, low, high))
            away = float(np.linalg.norm(places[number] + (here_m - begin_m) * way - place))
            if away < least:
                least, best_m = away, here_m
        self._at_m = best_m
        self._index = int(np.searchsorted(self._along_m, best_m + self._ahead_m, side="left"))
        self._index = min(self._index, len(self._targets) - 1)

    def _distance(self, place: np.ndarray, index: int) -> float:
        return float(np.linalg.norm(self._targets[index, : self._form.AXES] - place))

    def _is_within(self, state: RigidBodyState) -> bool:
        goal: Goal = self._task.goal_of(self._targets[-1:])
        one = self._form.from_rigid(
            RigidBodyState(
                state.position_in_world[None],
                state.quat_xyzw[None],
                state.velocity_in_world[None],
                state.angular_velocity_in_body[None],
            )
        )
        return bool(self._task.tolerance.holds(self._task.errors(one, stack_goals([goal])))[0])
