"""What a controller node has been told to do: goal, obstacles and block, and how far it has come."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from fulmar_core.geofence import distance_from_goal
from fulmar_core.goal import Goal, stack_goals
from fulmar_core.observation import Observer
from fulmar_core.planar import PlanarState, planar_of
from fulmar_core.robot import Robot
from fulmar_core.schedule import Schedule
from fulmar_core.state import RigidBodyState
from fulmar_core.tasks import Task, fitted, sees_obstacles
from fulmar_core.tasks.go_to_position_with_obstacles import GoToPositionWithObstacles
from fulmar_core.tasks.push_block import PushBlock

GOALS_REMEMBERED = 200  # stamps of goals; publishers repeat at most the last 100
BLOCK_LASTS_NS = 1_000_000_000  # where a block was longer ago, it need not be any more

GoalKey = tuple[int, int]  # stamp [ns] and hash of the targets


class Mission:
    """Not thread-safe; the caller holds a lock. Computes with a batch of one, as evaluations do with many."""

    def __init__(self, robot: Robot, task: Task, *, streamed: bool = False) -> None:
        """Begin without a goal.

        Args:
            robot: The robot.
            task: What it shall do.
            streamed: Goals come with each odometry, stamped as it is, mostly the same again.
        """
        self._robot, self._task, self._streamed = robot, fitted(task, robot), streamed
        self._observer = Observer(robot, task)
        self._goal: Goal | None = None
        # Velocities may be told ahead of their time; a place counts from when it comes, whoever's clock stamped it.
        self._schedule: Schedule[Goal] | None = Schedule() if task.goal_topic == "goal_velocity" else None
        self._since_ns: int | None = None
        self._obstacles: np.ndarray | None = None if sees_obstacles(task) else np.zeros((0, 3))
        self._pushes = isinstance(task, PushBlock)
        self._block: np.ndarray | None = None
        self._block_stamp_ns = 0
        self._batched_of: tuple[object, object, object] = (None, None, None)
        self._planar_of: RigidBodyState | None = None
        self._given: deque[GoalKey] = deque(maxlen=GOALS_REMEMBERED)  # since the last drop
        self._void: deque[GoalKey] = deque(maxlen=GOALS_REMEMBERED)  # refused, or dropped
        self.goal_stamp_ns = 0
        self.obstacles_stamp_ns = 0

    @property
    def lacking(self) -> str:
        """What the task needs and nobody has told; empty if everything is known."""
        parts = {"goal": self._goal, "obstacles": self._obstacles}
        if self._pushes:
            parts["place of the block"] = self._block
        return next((name for name, part in parts.items() if part is None), "")

    @property
    def complete(self) -> bool:
        """Whether everything is known that the task needs."""
        return not self.lacking

    @property
    def goal(self) -> Goal | None:
        """The goal with all its targets; None before there is one."""
        return self._goal

    @property
    def done(self) -> int:
        """Targets reached since the goal was given."""
        return 0 if self._goal is None else int(self._goal.done)

    def give(self, goal: Goal, stamp_ns: int) -> bool:
        """Take a new goal; its time begins with the next observation, or, of a velocity, when its stamp says.

        Returns:
            Whether something new begins: not so for a goal that is streamed again, or repeated with the same stamp for
            a subscriber that came late, and for velocities, which go on from one to the next.
        """
        if not self._streamed and stamp_ns:
            key = _key(goal, stamp_ns)
            if key in self._given:
                return False
            self._given.append(key)
        self.goal_stamp_ns = stamp_ns
        if self._schedule is not None:
            self._schedule.give(goal, stamp_ns)
            return False
        if self._streamed and self._goal is not None and np.array_equal(self._goal.targets, goal.targets):
            return False
        self._goal, self._since_ns = goal, None
        return True

    def drop(self) -> None:
        """Forget the goal, as after an emergency stop: what moves then is asked for anew, see `is_void`."""
        self._void.extend(self._given)
        self._given.clear()
        self._goal, self._since_ns = None, None
        if not self._streamed:  # where they are, it says which state need not wait
            self.goal_stamp_ns = 0
        if self._schedule is not None:
            self._schedule = Schedule()

    def is_void(self, goal: Goal, stamp_ns: int) -> bool:
        """Whether this very goal was refused or dropped: a repetition of it starts nothing.

        One with the stamp 0 is always new [ns].
        """
        return bool(stamp_ns) and _key(goal, stamp_ns) in self._void

    def refuse(self, goal: Goal, stamp_ns: int) -> None:
        """Note that a goal came and does not count, neither now nor repeated [ns]."""
        if self._streamed:
            self.goal_stamp_ns = stamp_ns  # the state of this time need not wait for it
        elif stamp_ns:
            self._void.append(_key(goal, stamp_ns))

    def turn_to(self, stamp_ns: int) -> None:
        """Let the goal count that belongs to a time of the plant's clock [ns]; forget a block not seen for long."""
        if self._schedule is not None:
            self._goal = self._schedule.at(stamp_ns)
        if self._pushes and stamp_ns - self._block_stamp_ns > BLOCK_LASTS_NS:
            self._block = None

    def see_obstacles(self, discs: np.ndarray, stamp_ns: int) -> None:
        """Take obstacles, shape (m, 3), instead of those known so far."""
        self._obstacles, self.obstacles_stamp_ns = discs, stamp_ns

    def see_block(self, place: np.ndarray, stamp_ns: int) -> None:
        """Take the place of the block, shape (2,) [m]."""
        self._block, self._block_stamp_ns = place, stamp_ns

    def lacks_something_of(self, stamp_ns: int) -> bool:
        """Whether the block, or a streamed goal, of this stamp is still to come."""
        block = self._pushes and self._block_stamp_ns != stamp_ns
        return block or (self._streamed and self.goal_stamp_ns != stamp_ns)

    def distance(self, state: RigidBodyState) -> float:
        """From a state to the current target; 0 where the task has none, infinite before everything is known [m]."""
        if not self.complete:
            return math.inf
        distance = distance_from_goal(self._task, self._batch(state), self._batched())
        return 0.0 if distance is None else float(distance[0])

    def observe(self, state: RigidBodyState, stamp_ns: int, previous_command: np.ndarray) -> np.ndarray:
        """Go on to the next target if the current one is reached, and observe.

        Args:
            state: Measured state.
            stamp_ns: When it was measured [ns].
            previous_command: What was last commanded, shape (m,).

        Returns:
            What the controller sees, shape (n,).
        """
        assert self._goal is not None
        body = self._batch(state)
        if self._since_ns is None:
            self._since_ns = stamp_ns
            self._begin(body)
        else:
            time_s = np.array([(stamp_ns - self._since_ns) / 1e9])
            self._advance(body, time_s)
        return np.asarray(self._observer(body, self._batched(), previous_command[None]))[0]

    def _begin(self, body: PlanarState) -> None:
        """Tell the goal where the robot is, where it asks for that."""
        begun = getattr(self._task, "begun", None)
        if begun is not None:
            self._goal = begun(self._batched(), body)[0]

    def _advance(self, body: PlanarState, time_s: np.ndarray) -> None:
        """Take the next goal, or keep the very one where it is the same."""
        before = self._batched()
        after = self._task.advance(before, body, time_s)
        if after is not before:
            self._goal = after[0]

    def _batched(self) -> Goal:
        """Goal and surroundings as a batch of one; the same again while nothing of them changed."""
        goal, obstacles = self._goal, self._obstacles
        assert goal is not None and obstacles is not None
        block = self._block if self._pushes else goal.block
        assert block is not None
        parts = (goal, obstacles, block)
        if any(new is not old for new, old in zip(parts, self._batched_of, strict=True)):
            batched = stack_goals([Goal(goal.targets, np.asarray(goal.done), obstacles, block)])
            if isinstance(self._task, GoToPositionWithObstacles):
                batched = self._task.surveyed(batched, self._robot)
            self._batched_goal = batched
            self._batched_of = parts
        return self._batched_goal

    def _batch(self, state: RigidBodyState) -> PlanarState:
        """A state as a batch of one; it is asked for several times in a row."""
        if state is not self._planar_of:
            self._planar_of, self._planar = state, planar_of(state)[None]
        return self._planar


def _key(goal: Goal, stamp_ns: int) -> GoalKey:
    return stamp_ns, hash(np.asarray(goal.targets, dtype=float).tobytes())
