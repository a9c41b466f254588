"""Mission of one robot: goal, obstacles and things as received, and goals that begin at a time of their own."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import Generic, TypeVar

import numpy as np

from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.states.state import State
from fulmar_core.tasks.goal import PLACES, Goal, stack_goals

# A stamp further ahead is of another clock, as a person's beside a simulation's.
LONGEST_AHEAD_NS = 600_000_000_000
SLACK_NS = 1_000  # of rounding between a sender's seconds and the plant's

T = TypeVar("T")


def begins_ns(stamp_ns: int, now_ns: int) -> int:
    """Start on the plant's clock of what came at `now_ns`: its stamp, or at once where that is past or 0 [ns]."""
    return stamp_ns if now_ns < stamp_ns <= now_ns + LONGEST_AHEAD_NS else now_ns


class Schedule(Generic[T]):
    """Things that begin one after another; a new one takes the place of all that would begin with it or later."""

    def __init__(self) -> None:
        self._entries: list[tuple[int, T]] = []  # when each begins [ns], in order; what is over is forgotten
        self._arrived: list[tuple[int, T]] = []  # stamps; when they begin is known once the plant's clock is

    def give(self, item: T, stamp_ns: int) -> None:
        """Take something new with its stamp [ns]."""
        self._arrived.append((stamp_ns, item))

    def at(self, now_ns: int) -> T | None:
        """What goes on at a time of the plant's clock, never less than before [ns]; None before anything has begun."""
        for stamp_ns, item in self._arrived:
            begin_ns = begins_ns(stamp_ns, now_ns)
            self._entries = [entry for entry in self._entries if entry[0] < begin_ns] + [(begin_ns, item)]
        self._arrived.clear()
        while len(self._entries) > 1 and self._entries[1][0] <= now_ns + SLACK_NS:
            del self._entries[0]
        if not self._entries or self._entries[0][0] > now_ns + SLACK_NS:
            return None
        return self._entries[0][1]


GOALS_REMEMBERED = 200  # stamps of goals; publishers repeat at most the last 100
THING_LASTS_NS = 1_000_000_000  # where a thing was longer ago, it need not be any more

STREAM_NS = (
    1_000_000_000  # between the stamps of a target that moves, at most; a person's goals are farther apart
)

GoalKey = tuple[int, int]  # stamp [ns] and hash of the targets


class Mission:
    """Keeps what was received, and the goal of a control loop in step with it. Not thread-safe.

    Attributes:
        goal_stamp_ns: Of the newest goal; 0 without one [ns].
        obstacles_stamp_ns: Of the newest obstacles [ns].
        goals_received: Goals that began something new; of velocities that follow one another, the first.
        moved: Whether the newest goal goes on from the one before: a stream whose target moved by no more than the
            tolerance.
    """

    def __init__(self, loop: ControlLoop, *, streamed: bool = False) -> None:
        """Begin without a goal; `streamed`: goals come with each odometry, stamped as it is, mostly the same again."""
        self._loop, self._task, self._streamed = loop, loop.task, streamed
        self._given_goal: Goal | None = None  # as it came, without a batch axis
        # Velocities may come ahead of their time; a place counts from when it comes, whatever clock stamped it.
        timed = self._task.goal_topic == "goal_velocity"
        self._schedule: Schedule[Goal] | None = Schedule() if timed else None
        self._obstacles: np.ndarray | None = None if self._task.sees_obstacles else np.zeros((0, 3))
        self._things: dict[str, tuple[np.ndarray, int]] = {}  # where each was, and when, of those seen [ns]
        self._given: deque[GoalKey] = deque(maxlen=GOALS_REMEMBERED)  # since the last drop
        self._void: deque[GoalKey] = deque(maxlen=GOALS_REMEMBERED)  # refused, or dropped
        self.goal_stamp_ns = 0
        self.obstacles_stamp_ns = 0
        self.goals_received = 0
        self.moved = False

    @property
    def lacking(self) -> str:
        """What the task needs and has not come; empty if everything is known."""
        parts = {"goal": self._given_goal, "obstacles": self._obstacles}
        unseen = [thing.name for thing in self._task.things if thing.name not in self._things]
        lacking = [name for name, part in parts.items() if part is None]
        return next(iter((*lacking, *(f"place of the {name}" for name in unseen))), "")

    @property
    def done(self) -> int:
        """Targets reached since the goal was given."""
        return 0 if self._loop.goal is None else int(self._loop.goal.done[0])

    def give(self, goal: Goal, stamp_ns: int) -> bool:
        """Take a new goal; its time begins with the next step, or, of a velocity, when its stamp says.

        Returns:
            Whether something new begins: not so for a goal that is streamed again, or repeated with the same stamp for
            a subscriber that came late, and for velocities, which go on from one to the next.
        """
        if not self._streamed and stamp_ns:
            key = _key(goal, stamp_ns)
            if key in self._given:
                return False
            self._given.append(key)
        since_ns, self.goal_stamp_ns = stamp_ns - self.goal_stamp_ns, stamp_ns
        if self._schedule is not None:
            self.goals_received += self._given_goal is None
            self._schedule.give(goal, stamp_ns)
            return False
        same = self._given_goal is not None and np.array_equal(self._given_goal.targets, goal.targets)
        if self._streamed and same:
            return False
        self.moved = not same and 0 < since_ns <= STREAM_NS and self._goes_on(goal)
        self.goals_received += not self.moved
        self._take(goal, anew=not self.moved)
        return True

    def _goes_on(self, goal: Goal) -> bool:
        """Whether a robot that is at the goal's target so far is at that of another goal, too."""
        given, task = self._given_goal, self._task
        place = task.goal_topic in PLACES and not task.things and not task.sees_obstacles
        if given is None or self._loop.goal is None or not place:
            return False
        there = task.state_type.resting(np.asarray(given.targets, dtype=float))
        return bool(task.tolerance.holds(task.errors(there, stack_goals([goal])))[0])

    def drop(self) -> None:
        """Forget the goal, as after an emergency stop: what moves then is asked for anew, see `is_void`."""
        self._void.extend(self._given)
        self._given.clear()
        self._take(None)
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
        """Let the goal count that belongs to a time of the plant's clock [ns]; forget things not seen for long."""
        if self._schedule is not None:
            due = self._schedule.at(stamp_ns)
            if due is not self._given_goal:
                self._take(due, anew=self._given_goal is None or due is None)
        for name, (_, seen_ns) in list(self._things.items()):
            if stamp_ns - seen_ns > THING_LASTS_NS:
                del self._things[name]
                self._loop.begin(None)

    def see_obstacles(self, discs: np.ndarray, stamp_ns: int) -> None:
        """Take obstacles, shape (m, 3), instead of those known so far."""
        self._obstacles, self.obstacles_stamp_ns = discs, stamp_ns
        self._refresh()

    def see_thing(self, name: str, pose: np.ndarray, stamp_ns: int) -> None:
        """Take the pose of a thing: the task's own, 3 numbers in the plane [m, m, rad], 7 in space [m, -]."""
        self._things[name] = pose, stamp_ns
        self._refresh()

    def lacks_something_of(self, stamp_ns: int) -> bool:
        """Whether a thing, or a streamed goal, of this stamp is still to come."""
        seen = sum(seen_ns == stamp_ns for _, seen_ns in self._things.values())
        return seen < len(self._task.things) or (self._streamed and self.goal_stamp_ns != stamp_ns)

    def distance(self, state: State) -> float:
        """Distance from the current target [m]; 0 where the task has none, infinite before one is known.

        Args:
            state: Measured, shapes (1,).
        """
        if self._loop.goal is None:
            return math.inf
        distance = self._task.distance_from_goal(state, self._loop.goal)
        return 0.0 if distance is None else float(distance[0])

    def within_tolerance(self, state: State) -> bool:
        """Whether a state lies within the task's tolerance of the current target.

        Args:
            state: Measured, shapes (1,).
        """
        if self._loop.goal is None:
            return False
        return bool(self._task.tolerance.holds(self._task.errors(state, self._loop.goal))[0])

    def _take(self, goal: Goal | None, *, anew: bool = True) -> None:
        """Let another goal count, from its first target on; its time begins now unless it goes on from one before."""
        self._given_goal = goal
        if anew:
            self._loop.begin(None)
        elif self._loop.goal is not None:
            self._loop.goal = replace(self._loop.goal, done=np.zeros(1))
        self._refresh()

    def _refresh(self) -> None:
        """Give the loop its goal among what stands about now, as far along as it has come."""
        goal, obstacles = self._given_goal, self._obstacles
        if goal is None or obstacles is None or len(self._things) < len(self._task.things):
            return
        before = goal if self._loop.goal is None else self._loop.goal[0]
        here = {**before.things, **{name: pose for name, (pose, _) in self._things.items()}}
        batched = stack_goals([replace(goal, done=np.asarray(before.done), obstacles=obstacles, things=here)])
        self._loop.goal = self._task.surveyed(batched, self._loop.robot)


def _key(goal: Goal, stamp_ns: int) -> GoalKey:
    return stamp_ns, hash(np.asarray(goal.targets, dtype=float).tobytes())
