"""A controller goes through a recorded run again, without ROS, as the controller node would lead it.

What it is shown is what was recorded: each answer is compared with the recorded one, and the next step goes on from the
record, not from the new answer. So one different command does not make everything after it different.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_bringup.bags.course import ABSENT, Course
from fulmar_core.controllers.controller import Controller
from fulmar_core.errors import BagError, RunFailed
from fulmar_core.health.informer import Informer
from fulmar_core.observation import slewed
from fulmar_core.planar import planar_of
from fulmar_core.rotation import rotate
from fulmar_core.safety.arbiter import Flags, arbitrate
from fulmar_core.safety.command_gate import command_problem
from fulmar_core.safety.input_gate import InputGate, Measurement
from fulmar_core.state import RigidBodyState
from fulmar_ros.mission import Mission

FROM = ("observations", "odometry")
LONGEST_NS = 1 << 60  # of an input timeout that never passes: a record has no steady clock


@dataclass(frozen=True)
class Answers:
    """What a controller said to each step of a course; NaN where it was not asked."""

    observations: np.ndarray  # (n, k) what it was shown
    observation_names: tuple[str, ...]
    actions: np.ndarray  # (n, m) before limits
    commands: np.ndarray  # (n, m) after limits; the safe one where it was not asked
    acted: np.ndarray  # (n,)
    reasons: tuple[str, ...]  # why it was not asked, by step; empty where it was


def rerun(course: Course, controller: Controller, *, source: str = "observations") -> Answers:
    """Let a controller answer a recorded run.

    Args:
        course: The run.
        controller: Made anew; warmed up or not.
        source: `observations` shows what was recorded; `odometry` makes observations anew, with the node's gates.

    Returns:
        Its answers.

    Raises:
        BagError: The bag lacks what the source needs, or its observations are another controller's.
        RunFailed: The controller raises; with the step.
    """
    if source == "observations":
        _check_observations(course, controller)
    elif not len(course.odometry):
        raise BagError("the bag holds no odometry to make observations from. Use --from observations.")
    return _Rerun(course, controller, source).run()


def _check_observations(course: Course, controller: Controller) -> None:
    if not course.observation_names:
        raise BagError("the bag holds no observations. Use --from odometry to make them anew.")
    if course.observation_names != controller.observation_names:
        gone = [name for name in course.observation_names if name not in controller.observation_names]
        new = [name for name in controller.observation_names if name not in course.observation_names]
        what = (
            f"lacks {', '.join(new)}"
            if new
            else f"has {', '.join(gone)} too"
            if gone
            else "has another order"
        )
        raise BagError(
            f"the recorded observation {what}, so '{controller.name}' cannot read it. Use --from odometry."
        )


class _Rerun:
    """One pass; mirrors `ControllerNode` step by step."""

    def __init__(self, course: Course, controller: Controller, source: str) -> None:
        self._course, self._controller, self._source = course, controller, source
        robot = course.robot
        self._robot, self._safe = robot, robot.actuators.safe_command
        self._pause_ns = course.settings.pause_ns(robot)
        self._control_s = round(1e9 / course.settings.control_rate(robot)) / 1e9
        self._informer = Informer(robot, controller)
        self._mission = Mission(robot, course.task, streamed=course.settings.goals_streamed)
        self._gate = InputGate(robot.limits, frozen_after=0)
        self._answered_ns, self._answer, self._seen_ns = -1, self._safe, 0
        self._states = _States(course)
        # Which steps were gated is known of lock step alone: in real time it hangs on when messages came.
        self._gated = source == "odometry" and (course.settings.lockstep or not course.own)
        self._fed = 0
        self._problem = ""

    def run(self) -> Answers:
        course, count = self._course, len(self._course)
        actuators = len(self._robot.actuators.names)
        names = self._controller.observation_names
        shown = np.full((count, len(names)), np.nan)
        actions, commands = np.full((count, actuators), np.nan), np.tile(self._safe, (count, 1)).astype(float)
        acted, reasons = np.zeros(count, dtype=bool), [""] * count
        goals = course.before(course.goals)
        obstacles, blocks = course.before(course.obstacles), course.before(course.blocks)
        self._controller.reset()
        for step in range(count):
            stamp = int(course.stamp_ns[step])
            for told in obstacles.get(step, ()):
                self._mission.see_obstacles(told.what, told.stamp_ns)
            for told in blocks.get(step, ()):
                self._mission.see_block(told.what, told.stamp_ns)
            for told in goals.get(step, ()):
                if self._mission.give(told.what, told.stamp_ns):
                    self._controller.reset()
                if course.settings.lockstep:
                    self._gate.forget()
            reasons[step] = self._reason(step)
            acted[step] = not reasons[step]
            if acted[step]:
                self._begin_anew_after_a_pause(stamp)
                shown[step] = self._shown(step)
            self._inform(step)
            if acted[step]:
                actions[step] = self._act(step, shown[step])
                commands[step] = self._limited(actions[step])
            recorded = course.commands[step]
            self._answered_ns = stamp
            self._answer = commands[step] if np.isnan(recorded).any() else recorded
        if not course.own and not self._mission.complete:  # in a bag of our own, it belongs to the run
            raise self._goalless()
        return Answers(shown, names, actions, commands, acted, tuple(reasons))

    def _reason(self, step: int) -> str:
        """Why the controller is not asked at a step; empty if it is."""
        course = self._course
        if self._source == "odometry":
            self._feed_gate(step)
        if not self._gated:
            lacks = self._source == "odometry" and course.sample[step] == ABSENT
            return "not asked in the record" if not course.acted[step] or lacks else ""
        state = self._states[int(course.sample[step])] if course.sample[step] != ABSENT else None
        flags = Flags(
            configured=True,
            activated=True,
            has_goal=self._mission.complete,
            lacking=self._mission.lacking,
            last_input_ns=0 if state is not None else None,
            input_problem=self._problem,
            input_timeout_ns=LONGEST_NS,
            goal_distance=self._mission.distance(state) if state is not None else 0.0,
            geofence=self._robot.limits.geofence,
        )
        return arbitrate(flags, 0).reason

    def _feed_gate(self, step: int) -> None:
        """Take all odometry up to that of a step, as the node's subscription does."""
        course, last = self._course, int(self._course.sample[step])
        while self._fed <= last:
            index = self._fed
            self._fed += 1
            frame, child = course.odometry.frame[index], course.odometry.child_frame[index]
            if not course.own:  # others name their frames as they please
                frame, child = "odom", "base_link"
            stamp = int(course.odometry.stamp_ns[index])
            problem = self._gate.problem(Measurement(stamp, frame, child, self._states[index])) or ""
            if problem == "odom stamp did not advance" and course.settings.lockstep:
                continue  # the plant asked again, and had the same answer
            self._problem = problem
            if not problem or not self._gated:
                self._mission.turn_to(stamp)

    def _begin_anew_after_a_pause(self, stamp: int) -> None:
        if stamp - self._answered_ns > self._pause_ns:
            self._answer = self._safe
            self._controller.reset()

    def _shown(self, step: int) -> np.ndarray:
        if self._source == "observations":
            return np.asarray(self._course.observations[step])
        if not self._mission.complete:
            raise self._goalless()
        sample = int(self._course.sample[step])
        return self._mission.observe(self._states[sample], int(self._course.stamp_ns[step]), self._answer)

    def _goalless(self) -> BagError:
        what, task = self._mission.lacking, self._course.task.name
        return BagError(f"the bag holds no {what} for '{task}'. Give --goal x,y,deg.")

    def _inform(self, step: int) -> None:
        """Tell the controller how its actuators do, if it wants to know."""
        sample = int(self._course.sample[step])
        if not self._informer.listens or sample == ABSENT:
            return
        stamp = int(self._course.stamp_ns[step])
        passed_ns = stamp - self._seen_ns
        if passed_ns == 0:
            return
        if not 0 < passed_ns <= self._pause_ns:
            self._informer.reset()
        self._seen_ns = stamp
        self._informer.see(planar_of(self._states[sample]), self._answer, passed_ns / 1e9)

    def _act(self, step: int, observation: np.ndarray) -> np.ndarray:
        try:
            return np.asarray(self._controller.act(observation), dtype=float)
        except Exception as error:
            raise RunFailed(
                f"'{self._controller.name}' raised {type(error).__name__} at step {step}: {error}"
            ) from error

    def _limited(self, action: np.ndarray) -> np.ndarray:
        if command_problem(action, len(self._robot.actuators.names)):
            return self._safe
        return slewed(self._robot.actuators.limited(action), self._answer, self._robot, self._control_s)


class _States:
    """The state of each odometry message, made when it is asked for."""

    def __init__(self, course: Course) -> None:
        seen = course.odometry
        self._pose, self._turn = seen.pose, seen.twist[:, 3:]
        # The arithmetic of `message_reader.measurement_of`, for all messages at once: equal to the last bit.
        self._velocity = rotate(seen.pose[:, 3:], seen.twist[:, :3])
        self._last: tuple[int, RigidBodyState] | None = None

    def __getitem__(self, index: int) -> RigidBodyState:
        if self._last is None or self._last[0] != index:  # one step asks for its own several times
            pose = self._pose[index]
            state = RigidBodyState(pose[:3], pose[3:], self._velocity[index], self._turn[index])
            self._last = index, state
        return self._last[1]
