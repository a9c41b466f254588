"""The scene of one robot: what was received last, the shapes that show it, and which of them are gone."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.safety.arbiter import Mode
from fulmar_core.safety.geofence import NO_AREA
from fulmar_core.tasks import Task
from fulmar_ros.scene.by_kind import APPLIED
from fulmar_ros.scene.goal_shapes import area_shapes, geofence_shapes, goal_shapes, obstacle_shapes
from fulmar_ros.scene.robot_shapes import body_shapes
from fulmar_ros.scene.shape import Shape
from fulmar_ros.scene.structure_shapes import structure_shapes

REMEMBERED = 200  # goals: velocities come up to a hundred ahead of their time
STEP = 0.02  # share of full command by which what is applied has to change to be drawn anew
Key = tuple[str, int]


@dataclass(frozen=True)
class Change:
    """What viewers draw from here on: every shape that there is, and those that are gone."""

    shapes: tuple[Shape, ...]
    gone: tuple[Key, ...]


class Scene:
    """Keeps what was received of one robot, and says what changed since it was asked last."""

    def __init__(self, robot: Robot, task: Task, area: Sequence[float] = NO_AREA) -> None:
        """Begin with the body, the things in space of the task and, where there is one, the area of the robot [m]."""
        self._robot, self._task = robot, task
        self._fixed = [*body_shapes(robot), *area_shapes(area), *structure_shapes(task.structures)]
        self._goals: deque[tuple[int, np.ndarray]] = deque(maxlen=REMEMBERED)
        self._status: Mapping[str, str] = {}
        self._obstacles = np.zeros((0, 3))
        self._applied: list[np.ndarray] = []  # since it was asked last
        self._shown = np.zeros(len(robot.actuators.names))
        self._last: dict[Key, Shape] = {}
        self._gone: set[Key] = set()

    def give_goal(self, targets: np.ndarray, stamp_ns: int) -> None:
        """Take a goal that was received, as in `goal_shapes`."""
        self._goals.append((stamp_ns, targets))

    def give_status(self, values: Mapping[str, str]) -> None:
        """Take the values of the controller's status: which goal counts, and how many targets are done."""
        self._status = values

    def give_obstacles(self, obstacles: np.ndarray) -> None:
        """Take obstacles as in `obstacle_shapes`."""
        self._obstacles = obstacles

    def give_applied(self, names: Sequence[str], effort: Sequence[float]) -> None:
        """Take what the actuators do; a message that lacks an actuator or has other values than names is left out."""
        by_name = dict(zip(names, effort, strict=False))
        values = np.array([by_name.get(name, np.nan) for name in self._robot.actuators.names], dtype=float)
        if np.isfinite(values).all():
            self._applied.append(values)

    def forget_applied(self) -> None:
        """The plant fell silent: what its actuators do is unknown."""
        self._applied.clear()
        self._shown = np.zeros_like(self._shown)

    def change(self) -> Change | None:
        """What viewers draw, complete; None where nothing changed since it was asked last."""
        shapes = {shape.key: shape for shape in (*self._fixed, *self._of_goal(), *self._of_applied())}
        shapes |= {shape.key: shape for shape in obstacle_shapes(self._obstacles)}
        if shapes == self._last:
            return None
        self._gone = (self._gone | self._last.keys()) - shapes.keys()
        self._last = shapes
        return Change(tuple(shapes.values()), tuple(sorted(self._gone)))

    def _of_goal(self) -> list[Shape]:
        targets = self._goal()
        if targets is None:
            return []
        done = self._number("goals_done")
        return [
            *goal_shapes(targets, done, self._task, self._robot),
            *geofence_shapes(targets, done, self._robot),
        ]

    def _goal(self) -> np.ndarray | None:
        """The goal that the controller follows; without its status the newest one."""
        if not self._goals:
            return None
        newest_ns, newest = self._goals[-1]
        if not self._status:
            return newest
        stamp_ns = self._number("goal_stamp_ns")
        if stamp_ns == 0:  # without a goal, or with one that has no stamp
            waits = newest_ns != 0 or self._status.get("mode") == Mode.ARMED.value
            return None if waits else newest
        return next((targets for ns, targets in reversed(self._goals) if ns == stamp_ns), newest)

    def _number(self, key: str) -> int:
        """A whole number of the controller's status; 0 where it has none, as that of another program."""
        text = self._status.get(key, "")
        return int(text) if text.isdecimal() and len(text) < 20 else 0

    def _of_applied(self) -> list[Shape]:
        """What the actuators did on average since it was asked last: a short pulse shows, too."""
        if self._applied:
            mean = np.mean(self._applied, axis=0)
            self._applied.clear()
            moved = np.abs(mean - self._shown) >= STEP * self._robot.actuators.scale
            # All or nothing: what goes to rest is drawn at rest.
            if moved.any() or not mean.any():
                self._shown = mean
        return APPLIED[self._robot.kind.name](self._robot, self._robot.actuators, self._shown.tolist())
