"""A controller that plans a boat's whole course: a learned policy drives while it plans, and where it has no plan.

It is told the course, which policies never see whole. From the observation it knows where it is on it. It rehearses
what the policy would do for some seconds, follows that, and has a plan made meanwhile that goes on from there
(`search`); then it follows the plan. Where the boat is driven off, misses a waypoint, or the plan is late, it begins
anew.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from concurrent.futures import wait
from dataclasses import asdict
from typing import Any

import numpy as np

from fulmar_core.controllers.controller import Controller
from fulmar_core.controllers.seen import Reader
from fulmar_core.robot import Robot
from fulmar_core.rotation import Array
from fulmar_core.tasks import Task
from fulmar_core.tasks.passing import PassingTask
from policy_server.planning.beam import Beam
from policy_server.planning.boat import Boat
from policy_server.planning.estimator import Estimator
from policy_server.planning.pilot import Pilot
from policy_server.planning.program import Program
from policy_server.planning.reference import Follower
from policy_server.planning.rehearsal import Rehearsal
from policy_server.planning.search import Order, Search, lengths
from policy_server.planning.settings import PlannerSettings
from policy_server.planning.trial import Trial
from policy_server.planning.workers import Planning, Solvers

LEAST_WAYPOINTS = 3  # of a course that can be planned
_PATIENCE_S = 0.15  # waited at each step of a rehearsal, less than what a plant takes for silence [s]
_LEAST_HORIZON_S = 20.0  # that a plan looks ahead at the end of an episode, and after it [s]


class Planner:
    """Follows plans of the course; drives as its policy does where nobody told it one."""

    name = "planner"

    def __init__(
        self,
        robot: Robot,
        task: Task,
        make_policy: Callable[[], Controller],
        settings: PlannerSettings,
        *,
        patient: bool = True,
    ) -> None:
        """Get ready.

        Args:
            robot: The boat.
            task: One that `check_planner` takes.
            make_policy: Loads the policy; called thrice: one drives, two are rehearsed with.
            settings: How to plan.
            patient: Wait for plans that are not ready in time, as nothing moves meanwhile. In real time they are given
                up, as the next command cannot wait.
        """
        self._policy, self._settings, self._patient = make_policy(), settings, patient
        self._robot, self._task = robot, task
        self.control_hz = self._policy.control_hz
        self.observation_names = self._policy.observation_names
        self._dt = 1.0 / self.control_hz
        self._reader, self._boat = Reader(robot, task), Boat(robot)
        self._rehearsal = Rehearsal(robot, task, make_policy())
        self._follower = Follower(self._boat, settings, self._dt)
        self._lead = round(settings.lead_s / self._dt)
        self._soon = round(settings.soon_s / self._dt)
        self._limit = passing_tolerance(task)
        self._solvers = Solvers(
            lambda legs: Program(Boat(robot), legs=legs, nodes=settings.nodes),
            None if patient else 1,
        )
        boat = Boat(robot)
        beam = Beam(
            boat, Rehearsal(robot, task, make_policy()), settings, self._dt, wanted=self._solvers.take_work
        )
        search = Search(beam, settings, self._solvers, dt=self._dt)
        self._planning = Planning(
            search, Trial(robot, task, Follower(boat, settings, self._dt), settings, self._dt)
        )
        self._places: np.ndarray | None = None
        self._pilots: list[Pilot] = []

    def warm_up(self) -> None:
        """Write down now what the first plan would have to wait for seconds for."""
        self._solvers.warm_up(lengths(self._settings.legs))

    def hear_course(self, places: np.ndarray) -> None:
        """Take the course; as of `Farsighted`. Another one than before is begun anew."""
        if self._places is None or not np.array_equal(places, self._places):
            self._let_go()
            self._places = np.array(places, dtype=float)

    def coming(self, places: np.ndarray) -> np.ndarray | None:
        """As of `Navigator`; it knows from where it believes to be, and not from single readings."""
        if not self._pilots or self._places is None or not np.array_equal(places, self._places):
            return None
        coming = [pilot.coming for pilot in self._pilots]
        return np.reshape(coming, self._places.shape[:-2])

    def reset(self) -> None:
        """Forget the past, and the course."""
        self._let_go()
        self._policy.reset()

    def act(self, observation: Array) -> Array:
        """Choose commands; shapes as of `Controller.act`."""
        rows = np.atleast_2d(np.asarray(observation, dtype=float))
        if self._places is None or self._places.shape[-2] < LEAST_WAYPOINTS:
            return self._policy.act(observation)
        places = self._places.reshape(-1, *self._places.shape[-2:])
        if len(places) != len(rows):
            return self._policy.act(observation)
        if not self._pilots:
            self._set_out(places)
        commands = self._steer(rows)
        return commands.reshape(*np.shape(observation)[:-1], -1)

    def metadata(self) -> dict[str, Any]:
        """Policy, settings and pair, with the SHA-256 of everything but code that commands depend on."""
        policy = self._policy.metadata()
        told = {
            "controller": self.name,
            "robot": self._robot.name,
            "task": self._task.name,
            "control_hz": self.control_hz,
            "settings": asdict(self._settings),
            "policy_sha256": policy["sha256"],
        }
        pair = {"whole_robot": asdict(self._robot), "whole_task": asdict(self._task)}
        text = json.dumps(told | pair, sort_keys=True)
        return told | {"sha256": hashlib.sha256(text.encode()).hexdigest()}

    def _let_go(self) -> None:
        """Forget the course, and what is ordered for it."""
        for pilot in self._pilots:
            self._give_up(pilot)
        self._places, self._pilots = None, []

    def _give_up(self, pilot: Pilot) -> None:
        """Forget what a boat has ordered; if nobody else waits for it, what comes next must not wait behind it."""
        ordered, pilot.ordered = pilot.ordered, None
        if ordered and not any(other.ordered and other.ordered[0] is ordered[0] for other in self._pilots):
            ordered[0].cancel()

    def _set_out(self, places: np.ndarray) -> None:
        """Begin courses, shape (rows, k, 2) [m]."""
        told = self._settings
        late = round(told.late_s / self._dt)
        self._pilots = [Pilot(course, told, limit=self._limit, late_steps=late) for course in places]
        self._estimator = Estimator(
            self._robot,
            self._task,
            rows=len(places),
            control_hz=self.control_hz,
            trust=told.trust,
            carried=told.carried,
        )

    def _steer(self, rows: np.ndarray) -> np.ndarray:
        sight = np.stack([x + 1j * y for x, y in self._reader.in_sight(rows)], axis=-1)
        motion = np.stack(self._reader.motion(rows), axis=-1)
        told = self._reader.previous(rows)
        readings = [pilot.see(*seen) for pilot, *seen in zip(self._pilots, sight, motion, told, strict=True)]
        states = self._boat.useful(self._estimator.see(np.stack(readings)))
        if self._patient:
            wait({pilot.ordered[0] for pilot in self._pilots if pilot.ordered}, timeout=_PATIENCE_S)
        self._begin([i for i, pilot in enumerate(self._pilots) if self._needs_anew(pilot, states[i])], states)
        step = self._dt * self._boat.slew
        return np.stack(
            [pilot.command(state, step) for pilot, state in zip(self._pilots, states, strict=True)]
        )

    def _needs_anew(self, pilot: Pilot, state: np.ndarray) -> bool:
        """Whether a boat has nothing to follow; a plan that is ready is taken up where the rehearsal ends."""
        if pilot.at_end and not self._takes_up(pilot):
            return True
        lost = pilot.is_lost(state)
        pilot.losses += lost
        return lost

    def _takes_up(self, pilot: Pilot) -> bool:
        if pilot.ordered is None:
            return False
        plans, number = pilot.ordered
        plan = plans.result()[number] if self._patient or plans.done() else None
        self._give_up(pilot)
        if plan is None:
            return False
        pilot.go_on(plan)
        return True

    def _begin(self, which: list[int], states: np.ndarray) -> None:
        """Have some boats follow what the policy would do, and order their plans."""
        if not which:
            return
        pilots = [self._pilots[i] for i in which]
        for pilot in pilots:
            self._give_up(pilot)
        courses = np.stack([np.roll(pilot.places, -pilot.coming, axis=0) for pilot in pilots])
        seen = self._rehearsal.drive(states[which], courses, steps=self._lead + self._soon)
        orders = []
        for i, pilot in enumerate(pilots):
            end = self._end_of_lead(seen.done[i])
            done = seen.done[i, : end + 1]
            arrivals = np.searchsorted(done, np.arange(1, done[-1] + 1))
            pilot.follow(self._follower.of_samples(seen.states[i, : end + 1], arrivals))
            left_s = self._task.episode_s - self._dt * (pilot.steps + end)
            course = np.roll(courses[i], -int(done[-1]), axis=0)
            reach = self._settings.reach * self._settings.caution**pilot.losses * self._limit
            horizon_s = max(left_s, _LEAST_HORIZON_S)
            orders.append(Order(seen.states[i, end], course, horizon_s, reach, self._limit))
        ordered = self._planning.begin(orders)
        for number, pilot in enumerate(pilots):
            pilot.ordered = ordered, number

    def _end_of_lead(self, done: np.ndarray) -> int:
        """The control step that a plan begins at: not right before a waypoint, which it could only take as it comes."""
        passed = done > done[self._lead]
        return int(np.argmax(passed)) if passed[-1] else self._lead


def passing_tolerance(task: Task) -> float:
    """How near a waypoint of a task has to be passed [m]."""
    assert isinstance(task, PassingTask)
    return task.tolerance.position
