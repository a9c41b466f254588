"""A plan is tried in the core's own boat before it is followed.

What the boat does when it follows the plan is what is followed then: collocation joins nodes half a second apart by
cubics, and rounds corners of the thrust curve. And where the boat misses a waypoint already there, the plan is changed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.controllers.seen import Reader
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task
from policy_server.planning.boat import Boat
from policy_server.planning.pilot import Pilot
from policy_server.planning.reference import Follower, Reference
from policy_server.planning.rehearsal import Rehearsal
from policy_server.planning.search import Course
from policy_server.planning.settings import PlannerSettings
from policy_server.planning.whereabouts import Whereabouts

_AROUND = 6  # control steps around the one in which a waypoint should be passed


@dataclass(frozen=True)
class Tried:
    """How a plan was driven."""

    reference: Reference  # through what the boat did
    missed: np.ndarray  # (legs,) bool; which waypoints it passed too far away


class Trial:
    """Drives plans in the nominal boat and still water."""

    def __init__(
        self, robot: Robot, task: Task, follower: Follower, settings: PlannerSettings, dt: float
    ) -> None:
        """Whose plans they are, what follows them, and the control period [s]."""
        self._robot, self._task, self._follower = robot, task, follower
        self._settings, self._dt = settings, dt

    def drive(self, courses: list[Course]) -> list[Tried]:
        """Try the best plans of some courses, at least one, side by side."""
        plans = [self._follower.of_drive(course.best) for course in courses if course.best is not None]
        tracking = _Tracking(self._robot, self._task, courses, plans, self._settings, self._dt)
        seen = Rehearsal(self._robot, self._task, tracking).drive(
            np.stack([course.order.start for course in courses]),
            np.stack([course.order.places for course in courses]),
            steps=max(len(plan.changes) for plan in plans),
        )
        return [self._judged(*one) for one in zip(courses, plans, seen.states, strict=True)]

    def _judged(self, course: Course, plan: Reference, states: np.ndarray) -> Tried:
        states = states[: len(plan.changes) + 1]
        arrivals, missed, late = plan.arrivals.copy(), np.zeros(len(plan.arrivals), dtype=bool), 0
        for number in range(min(int(course.worth) + 1, len(arrivals))):  # those that may be passed in time
            first = max(plan.arrivals[number] + late - _AROUND, 0)
            off = np.hypot(*(states[first : first + 2 * _AROUND + 1, :2] - course.places[number]).T)
            if not len(off):
                break
            arrivals[number] = first + int(np.argmin(off))
            missed[number] = off.min() > self._settings.sure * course.order.limit
            late = arrivals[number] - plan.arrivals[number]
        return Tried(self._follower.of_samples(states, arrivals), missed)


class _Tracking:
    """A controller that follows a plan in each boat."""

    name = "tracking"
    observation_names: tuple[str, ...] = ()

    def __init__(
        self,
        robot: Robot,
        task: Task,
        courses: list[Course],
        plans: list[Reference],
        settings: PlannerSettings,
        dt: float,
    ) -> None:
        self._reader, boat = Reader(robot, task), Boat(robot)
        self._least, self._most, self._slew_step = boat.least, boat.most, dt * boat.slew
        self.control_hz = 1.0 / dt
        self._plans = plans
        late = round(settings.late_s / dt)
        self._pilots = [
            Pilot(
                course.order.places,
                settings,
                limit=course.order.limit,
                late_steps=late,
                where=_standing_at(course.order.start),
            )
            for course in courses
        ]

    def reset(self) -> None:
        """Nothing to forget; it drives once."""

    def act(self, observation: np.ndarray) -> np.ndarray:
        """Shapes as of `Controller.act`."""
        sight = np.stack([x + 1j * y for x, y in self._reader.in_sight(observation)], axis=-1)
        motion = np.stack(self._reader.motion(observation), axis=-1)
        told = np.clip(self._reader.previous(observation), self._least, self._most)
        commands = []
        for pilot, plan, *seen in zip(self._pilots, self._plans, sight, motion, told, strict=True):
            state = pilot.see(*seen)
            if pilot.steps == 1:
                pilot.follow(plan)
            else:
                pilot.is_lost(state)  # for where along the plan it is
            commands.append(pilot.command(state, self._slew_step))
        return np.stack(commands)

    def metadata(self) -> dict[str, object]:
        """It is in no bag."""
        return {}


def _standing_at(state: np.ndarray) -> Whereabouts:
    x, y, yaw = (float(each) for each in state[:3])
    return Whereabouts(x, y, yaw, 0)
