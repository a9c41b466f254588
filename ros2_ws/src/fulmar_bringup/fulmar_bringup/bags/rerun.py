"""A controller goes through a recorded run again, without ROS, as the controller node would lead it.

What it is shown is what was recorded: each answer is compared with the recorded one, and the next step goes on from the
record, not from the new answer. So one different command does not make everything after it different.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fulmar_bringup.bags.course import Course
from fulmar_bringup.bags.guarded import RecordedEstop
from fulmar_bringup.bags.told import ABSENT
from fulmar_core.controllers.controller import Controller
from fulmar_core.errors import BagError, FulmarError, RunFailed
from fulmar_core.health.applied import Applied, AppliedHistory
from fulmar_core.health.observer import report_applied
from fulmar_core.observation import slewed
from fulmar_core.rotation import rotate
from fulmar_core.safety.arbiter import Flags, arbitrate
from fulmar_core.safety.area import outside
from fulmar_core.safety.command_gate import command_problem
from fulmar_core.safety.input_gate import InputGate, Measurement
from fulmar_core.safety.succession import Succession
from fulmar_core.state import RigidBodyState
from fulmar_ros.mission import Mission
from fulmar_ros.standby import Standby, ready

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


def rerun(
    course: Course,
    controller: Controller,
    *,
    source: str = "observations",
    fallback: Controller | None = None,
    load: Callable[[str], Controller] | None = None,
) -> Answers:
    """Let a controller answer a recorded run, under the guards that the run had.

    Args:
        course: The run.
        controller: Made anew; warmed up or not.
        source: `observations` shows what was recorded; `odometry` makes observations anew, with the node's gates.
        fallback: Takes over where the node would have let it; warmed up here.
        load: Loads the bundle of a folder, to follow the recorded changes of policy; None follows none.

    Returns:
        Its answers.

    Raises:
        BagError: The bag lacks what the source or a guard needs, its observations are another controller's, or a
            policy that took over is another one by now.
        RunFailed: The controller raises and nobody takes over; with the step.
    """
    if source == "observations":
        _check_observations(course, controller)
    elif not len(course.odometry):
        raise BagError("the bag holds no odometry to make observations from. Use --from observations.")
    return _Rerun(course, controller, source, fallback, load).run()


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

    def __init__(
        self,
        course: Course,
        controller: Controller,
        source: str,
        fallback: Controller | None,
        load: Callable[[str], Controller] | None,
    ) -> None:
        self._course, self._source, self._load = course, source, load
        robot = course.robot
        self._robot, self._safe = robot, robot.actuators.safe_command
        self._pause_ns = course.settings.pause_ns(robot)
        self._control_ns = round(1e9 / course.settings.control_rate(robot))
        self._succession = Succession(Standby(controller, "", ""), ready(fallback) if fallback else None)
        self._mission = Mission(robot, course.task, streamed=course.settings.goals_streamed)
        self._gate = InputGate(robot.limits, frozen_after=0)
        self._answered_ns, self._answer = -1, self._safe
        self._states = _States(course)
        # Which steps were gated is known of lock step alone: in real time it hangs on when messages came.
        self._gated = source == "odometry" and (course.settings.lockstep or not course.own)
        self._estop = RecordedEstop(course.presses, required=self._gated and course.settings.estop)
        self._history = AppliedHistory(course.settings.hold_ns(robot))
        self._states_fed = 0  # states of the actuators that the history has taken
        self._observed_ns = 0  # stamp of the newest observation; 0 before the first of a controller
        # Of a robot without a bearing, and in a bag that says nothing of it, there is none to wait for.
        self._bearing_on = not course.bearing or bool(course.bearing[0].what)
        self._fed = 0
        self._problem, self._outside, self._fault = "", "", ""
        self._acted = 0  # control steps

    @property
    def _controller(self) -> Controller:
        return self._succession.current.controller

    def run(self) -> Answers:
        course, count = self._course, len(self._course)
        actuators = len(self._robot.actuators.names)
        names = self._controller.observation_names
        shown = np.full((count, len(names)), np.nan)
        actions, commands = np.full((count, actuators), np.nan), np.tile(self._safe, (count, 1)).astype(float)
        acted, reasons = np.zeros(count, dtype=bool), [""] * count
        goals = course.before(course.goals)
        bearing = course.before(course.bearing)
        obstacles, blocks = course.before(course.obstacles), course.before(course.blocks)
        changes = course.before(course.changes) if self._load else {}
        self._controller.reset()
        for step in range(count):
            stamp = int(course.stamp_ns[step])
            for told in obstacles.get(step, ()):
                self._mission.see_obstacles(told.what, told.stamp_ns)
            for told in blocks.get(step, ()):
                self._mission.see_block(told.what, told.stamp_ns)
            for told in bearing.get(step, ()):
                if told.what and not self._bearing_on:
                    self._controller.reset()
                self._bearing_on = told.what
            for told in goals.get(step, ()):
                if self._estop.holds(told.log_ns):
                    self._mission.refuse(told.what, told.stamp_ns)
                    continue
                if self._mission.is_void(told.what, told.stamp_ns):
                    continue
                if self._mission.give(told.what, told.stamp_ns):
                    self._controller.reset()
                if course.settings.lockstep:
                    self._gate.forget()
            for told in changes.get(step, ()):
                self._succession.propose(self._successor(*told.what))
            if self._succession.turn():
                self._observed_ns = 0
            reasons[step] = self._reason(step)
            acted[step] = not reasons[step]
            if acted[step]:
                self._begin_anew_after_a_pause(stamp)
                shown[step] = self._shown(step)
            try:
                if acted[step]:
                    report_applied(self._controller, self._applied(self._observed_ns, stamp))
                    self._observed_ns = stamp
                    actions[step] = self._act(shown[step])
            except Exception as error:  # noqa: BLE001 - whatever a controller raises, as in the node
                reasons[step] = self._give_up(step, error)
                acted[step], shown[step] = False, np.nan
            if acted[step]:
                commands[step] = self._judged(actions[step])
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
        log_ns, recorded = int(course.log_ns[step]), bool(course.acted[step])
        stopped = self._estop.reason(log_ns, acted=recorded)
        if self._estop.holds(log_ns) and (self._gated or not recorded):
            self._mission.drop()
        if not self._gated:
            lacks = self._source == "odometry" and course.sample[step] == ABSENT
            return "not asked in the record" if not recorded or lacks else ""
        state = self._states[int(course.sample[step])] if course.sample[step] != ABSENT else None
        flags = Flags(
            configured=True,
            activated=True,
            latched_fault=self._fault,
            has_goal=self._mission.complete,
            lacking=self._mission.lacking,
            last_input_ns=0 if state is not None else None,
            input_problem=self._problem,
            input_timeout_ns=LONGEST_NS,
            goal_distance=self._mission.distance(state) if state is not None else 0.0,
            geofence=self._robot.limits.geofence,
            estop=stopped,
            outside=self._outside,
            bearing_off=not self._bearing_on,
            active_s=self._acted * self._control_ns / 1e9,
            max_run_time_s=course.settings.max_run_time_s,
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
            if not problem:
                x, y = (float(value) for value in self._states[index].position_in_world[:2])
                self._outside = outside(x, y, course.settings.area)

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

    def _applied(self, begin_ns: int, end_ns: int) -> Applied | None:
        """What the actuators did between two measurements; the recorded command where the bag holds no more of it."""
        if not 0 < end_ns - begin_ns <= self._pause_ns:
            return None
        states = self._course.applied
        if not len(states):
            return Applied(np.array([self._answer], dtype=float), np.array([1e-9 * (end_ns - begin_ns)]))
        while self._states_fed < len(states) and states.stamp_ns[self._states_fed] < end_ns:
            index = self._states_fed
            self._states_fed += 1
            self._history.add(int(states.stamp_ns[index]), states.values[index])
        return self._history.between(begin_ns, end_ns)

    def _act(self, observation: np.ndarray) -> np.ndarray:
        action = np.asarray(self._controller.act(observation), dtype=float)
        self._acted += 1
        return action

    def _judged(self, action: np.ndarray) -> np.ndarray:
        """The command of an action; several in a row that are refused let the fallback take over, or are a fault."""
        problem = command_problem(action, len(self._robot.actuators.names))
        before = self._succession.current
        self._fault = self._succession.judge(problem) or self._fault
        if self._succession.current is not before:
            self._observed_ns = 0
        if problem:
            return self._safe
        limited = self._robot.actuators.limited(action)
        return slewed(limited, self._answer, self._robot, self._control_ns / 1e9)

    def _give_up(self, step: int, error: Exception) -> str:
        """Let the fallback take over from a controller that raised, and say why the step has no answer."""
        reason = f"'{self._controller.name}' raised {type(error).__name__} at step {step}: {error}"
        if not self._succession.fall_back(reason):
            raise RunFailed(reason) from error
        self._observed_ns = 0
        return reason

    def _successor(self, folder: str, sha256: str) -> Standby:
        """The policy that took over in the record."""
        assert self._load is not None
        where = f"the run went on with the policy of {folder}"
        try:
            found = ready(self._load(folder))
        except FulmarError as error:
            raise BagError(f"{where}, which cannot be loaded: {error}") from error
        if found.sha256 != sha256:
            raise BagError(f"{where}, which is another one by now. Ask one policy: --policy DIR.")
        return found


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
