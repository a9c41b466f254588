"""Guarded control loop of one robot: safety checks decide from what it receives whether its controller acts."""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from fulmar_core.controllers.controller import Controller, Inputs, Readings
from fulmar_core.controllers.excite import Excite
from fulmar_core.controllers.excite_wheels import ExciteWheels
from fulmar_core.controllers.rest import Rest
from fulmar_core.estimators.actuator_health.applied import AppliedHistory
from fulmar_core.loop.control_loop import ControlLoop, Step
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.loop.envelope import envelope_of
from fulmar_core.loop.fallback import ControllerSwitch, Standby
from fulmar_core.loop.mission import STREAM_NS, Mission
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.arbiter import BEYOND_GEOFENCE, Decision, Flags, arbitrate
from fulmar_core.safety.convergence import ConvergenceWatch
from fulmar_core.safety.envelope.guard import EnvelopeGuard
from fulmar_core.safety.geofence import (
    NO_AREA,
    OUT_OF_BOUNDS,
    check_area_of,
    farthest_goal,
    outside,
    unreachable,
)
from fulmar_core.safety.input_gate import InputGate, Measurement
from fulmar_core.states.state import RigidBodyState, State
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import Goal

ENDED = "the e-stop stopped this goal"


@dataclass(frozen=True, slots=True)
class Refusal:
    """A goal that does not count."""

    stamp_ns: int = 0
    reason: str = ""  # of the area, of the e-stop or of its message; empty if the newest goal counts


class Estop(Protocol):
    """What is known of the e-stop; see `EstopMonitor`."""

    @property
    def received(self) -> bool:
        """Whether it was ever received."""
        ...

    def reason(self, now_ns: int) -> str:
        """Why nothing may move; empty if it may."""
        ...


class GuardedLoop:
    """Takes what is received for one robot, decides whether its controller may act, and does control steps.

    Messages and control steps may come from different threads; a controller acts without the lock that they share.
    Times `now_ns` are those of one steady clock. What `take_...` returns says why something was not taken, and is empty
    if it was; of odometry, `take` says whether it was.

    Attributes:
        loop: Advances the goal, observes, and limits commands.
        mission: Goal, obstacles and things.
        switch: The controller that acts, and its fallback.
        newest: The newest usable measurement since the activation.
        readings: What the next step gets beside it, see `Inputs.readings`.
        acted: Control steps with a command of the controller's own since the activation.
        refusal: Why the newest goal does not count: it is invalid or out of bounds, or the e-stop refused it or took it
            away.
        too_far: Likewise, of a goal beyond the geofence, with its first distance.
    """

    def __init__(
        self,
        robot: Robot,
        task: Task,
        settings: ControllerSettings,
        switch: ControllerSwitch[Standby],
        estop: Estop,
        *,
        gate: InputGate | None = None,
        applied: AppliedHistory | None = None,
        envelope: EnvelopeGuard | None = None,
    ) -> None:
        """Begin without a goal.

        Args:
            robot: The robot.
            task: The task.
            settings: Limits and topics.
            switch: Has the controller.
            estop: Is asked before every step.
            gate: Of the measurements; that of the settings by default.
            applied: Commands that the actuators applied, as far as known.
            envelope: Guard of the robot's bounds; that of the settings by default.

        Raises:
            ConfigError: The area of the settings is none of such a robot.
        """
        check_area_of(robot, settings.area)
        self._lock = threading.Lock()
        self.switch = switch
        self.loop = ControlLoop(
            robot,
            task,
            switch.current.controller,
            pause_ns=settings.pause_ns(robot),
            applied=applied,
            envelope=envelope_of(robot, settings) if envelope is None else envelope,
            others=settings.others,
            formation=settings.place,
        )
        self.mission = Mission(self.loop, streamed=settings.goals_streamed)
        self.newest: Measurement | None = None
        self.readings: Readings = {}
        self._newest_state: State  # of `newest`, shapes (1,)
        self.acted = 0
        self.refusal = self.too_far = Refusal()
        self._followed = 0  # the number of the newest goal on which the controller acted
        self._settings, self._estop = settings, estop
        self._bounded = tuple(settings.area) != NO_AREA
        self._control_ns = round(1e9 / settings.control_rate(robot))
        self._flags = replace(settings.flags(robot), configured=True)
        self._bearing: bool | None = None if settings.has_bearing(robot) else True  # None: not received yet
        self._gate = gate or settings.input_gate(robot)
        self._convergence = ConvergenceWatch(robot, self.loop.task, self.loop.dt, applied)
        self._newest_epoch = self._acted_epoch = 0  # of the newest measurement, and of the last control step
        # Another goal came; the controller, which may be acting now, forgets at the next step.
        self._anew = False

    @property
    def flags(self) -> Flags:
        """What the arbiter decides by, as of now."""
        return self._flags

    @property
    def epoch(self) -> int:
        """Jumps of the measurements so far."""
        return self._gate.epoch

    @property
    def input_warning(self) -> str:
        """What is wrong with the source of the odometry now, in words that stay the same; empty if nothing."""
        return self._gate.warning

    @property
    def strives(self) -> bool:
        """Whether the controller means to meet the goal; those that excite a robot, or rest, do not."""
        return _strives(self.loop.controller)

    @property
    def held(self) -> str:
        """Why the keep-out guard acts in the controller's place, or that it came too late; empty if neither."""
        guard = self.loop.keep_out
        if guard is None or self.newest is None:
            return ""
        return guard.words(self._newest_state, [each.name for each in self.loop.task.structures])

    @property
    def kept_apart(self) -> str:
        """Why the guard holds the robot back from another one; empty where it does not."""
        return "" if self.loop.keep_apart is None else self.loop.keep_apart.words

    @property
    def lost_leader(self) -> str:
        """Why the robot holds its place in the stead of that in its formation; empty where it does not."""
        return "" if self.loop.formation is None else self.loop.formation.words

    @property
    def bearing_known(self) -> bool:
        """Whether the state of the air bearing has come, or there is none."""
        return self._bearing is not None

    def set(self, **changes: object) -> None:
        """Change flags by their names."""
        with self._lock:
            self._change(**changes)

    def at_goal(self) -> bool:
        """Whether the newest measurement lies within the task's tolerance of the current target."""
        with self._lock:
            return self.newest is not None and self.mission.within_tolerance(self._newest_state)

    def activate(self) -> None:
        """Wait for fresh measurements."""
        with self._lock:
            self.newest, self.acted = None, 0
            self._gate.forget()
            self._convergence.reset()
            self._change(activated=True, last_input_ns=None, input_problem="", outside="", unconverged="")

    def decide(self, now_ns: int) -> Decision:
        """Whether the controller may act now."""
        with self._lock:
            return self._arbitrate(now_ns)

    def take_bearing(self, on: bool) -> None:
        """Take the state of the air bearing; once it is on again, what controllers remember is of no use."""
        with self._lock:
            self._anew = self._anew or (on and self._bearing is False)
            self._bearing = on
            self._change(bearing_off=not on)

    def take_goal(self, targets: np.ndarray, stamp_ns: int, now_ns: int) -> str:
        """Take a goal as in `Task.goal_of`; none outside the robot's area, and none while a received e-stop holds."""
        goal = self.loop.task.goal_of(targets)
        with self._lock:
            beyond = self._beyond(goal)
            if beyond:
                self.refusal = Refusal(stamp_ns, beyond)
                self.mission.refuse(goal, stamp_ns)
                return beyond
            stopped = self._estop.reason(now_ns)
            if self._estop.received and stopped:
                self.refusal = Refusal(stamp_ns, stopped)
                self.mission.refuse(goal, stamp_ns)
                return f"{stopped}. Give a new goal once the e-stop is released."
            if self.mission.is_void(goal, stamp_ns):
                if not self.mission.goal_stamp_ns:
                    self.refusal = Refusal(stamp_ns, ENDED)
                return f"{ENDED}. Publish it with a new stamp."
            self.refusal = Refusal()
            since_ns = stamp_ns - self.mission.goal_stamp_ns
            if self.mission.give(goal, stamp_ns):
                self._anew = self._anew or not self.mission.moved
                if not (self._settings.goals_streamed or self.mission.moved):
                    # A new goal after a look at the robot: one that was outside its area may go on, if it is back.
                    self._change(outside=self._outside(), unconverged="")
                    if self.loop.envelope is not None:
                        self.loop.envelope.reset()
            elif self.loop.task.goal_topic == "goal_velocity" and not 0 <= since_ns <= STREAM_NS:
                self._change(unconverged="")
            self._follow_mission(rests=False)
            if self._settings.lockstep:
                self._gate.forget()
        return ""

    def refuse_goal(self, reason: str, stamp_ns: int) -> None:
        """Report a goal whose message is invalid; the one before stays."""
        with self._lock:
            self.refusal = Refusal(stamp_ns, reason)

    def take_obstacles(self, discs: np.ndarray, stamp_ns: int) -> None:
        """Take all obstacles that there are, shape (m, 3), in place of those known so far."""
        with self._lock:
            self.mission.see_obstacles(discs, stamp_ns)
            self._follow_mission()

    def take_thing(self, name: str, pose: np.ndarray, stamp_ns: int) -> None:
        """Take the pose of a thing of the task, shape (7,)."""
        with self._lock:
            self.mission.see_thing(name, self.loop.task.state_type.targets_of(pose), stamp_ns)
            self._follow_mission()

    def contest(self, reason: str) -> None:
        """Take no odometry while more than one node publishes an input, for a reason; with none, begin anew."""
        with self._lock:
            self._change(contested=reason)
            if not reason:
                self._anew = True
                self._gate.forget()

    def take(self, measurement: Measurement, now_ns: int) -> bool:
        """Take odometry; returns whether it is usable. If not, `decide` says why."""
        with self._lock:
            if self._flags.contested:
                return False
            problem = self._gate.problem(measurement) or ""
            if problem:
                self._change(input_problem=problem)
                return False
            self.newest, self._newest_epoch = measurement, self._gate.epoch
            self._newest_state = self._state_of(measurement)
            self.mission.turn_to(measurement.stamp_ns)
            self._follow_mission(
                last_input_ns=now_ns, input_problem="", outside=self._flags.outside or self._outside()
            )
        return True

    def switch_controller(self) -> bool:
        """Let a proposed controller take over, between two control steps; whether one has."""
        if self.switch.proposed is None or not self.switch.apply():
            return False
        self.loop.use(self.switch.current.controller)
        self._convergence.reset()
        return True

    def begin_step(self, measurement: Measurement | None, now_ns: int) -> tuple[Decision, Inputs | None]:
        """Begin a control step on a measurement: decide, and observe if the controller may act.

        Returns:
            The decision, and the inputs for `act`; None for a step that is answered by `ControlLoop.previous`: the safe
            command, or that of the guard of keep-out volumes.
        """
        with self._lock:
            decision = self._arbitrate(now_ns)
            self._begin_anew()
            if decision.may_act and measurement is not None:
                return decision, self._inputs(measurement)
            may_brake = decision.may_brake and measurement is not None
            brake = self._brake() if may_brake else None
        self._convergence.reset()
        if may_brake and brake is None and self._stops and measurement is not None:
            self.brake(measurement)
            return decision, None
        self.loop.rest(measurement.stamp_ns if measurement is not None else 0, brake)
        return decision, None

    def brake(self, measurement: Measurement) -> None:
        """Answer a measurement by the backup of the envelope guard, which has one; see `ControlLoop.brake`."""
        state = self._newest_state if measurement is self.newest else self._state_of(measurement)
        self.loop.brake(state, measurement.stamp_ns)

    def observe(self, measurement: Measurement) -> Inputs:
        """Observe for a controller that acts whatever the guards say, as one did in a record."""
        with self._lock:
            self._begin_anew()
            return self._inputs(measurement)

    def act(self, inputs: Inputs) -> Step:
        """Let the controller act; see `ControlLoop.act`. `watch` its step next, once the command is on its way."""
        step = self.loop.act(inputs)
        self.acted += 1
        return step

    def watch(self, inputs: Inputs, step: Step) -> None:
        """See whether the robot comes nearer to its goal; `note` says what follows of it.

        Raises:
            TaskError: The task cannot say how far it is.
        """
        if self.kept_apart:  # another robot is in the way: that it comes no nearer is no sign of a failure
            self._convergence.reset()
        elif self.strives:
            self._convergence.see(inputs, step.command)

    def note(self, refusal: str) -> bool:
        """Count refused actions (empty: not refused): several in a row switch to the fallback, or latch a fault.

        A controller whose robot does not converge gives way to the fallback, too; without one the robot stops until it
        is given a new goal.

        Returns:
            Whether the fallback acts from now on.
        """
        before = self.switch.current
        fault = self.switch.note(refusal or None)
        if fault:
            self.set(latched_fault=fault)
        stuck = self._convergence.problem
        if stuck:
            self._convergence.reset()
            if not self.switch.fall_back(stuck):
                self.set(unconverged=stuck)
        return self._follow_switch(before)

    def suspect(self, actuators: str, *, hopeless: bool = False) -> None:
        """Know of actuators that are believed dead, for the case that the robot does not converge.

        Args:
            actuators: Which, in words; empty for none.
            hopeless: Whether no pose can be held without them: then a task of poses stops at once, unless its
                controller estimates by itself which actuators work.
        """
        knows = self.loop.controller.estimator is not None
        self._convergence.dead, self._convergence.hopeless = actuators, hopeless and not knows

    def fall_back(self, reason: str) -> bool:
        """Let the fallback go on in place of a controller that raised; false if there is none."""
        before = self.switch.current
        self.switch.fall_back(reason)
        return self._follow_switch(before)

    def _begin_anew(self) -> None:
        """Let the controller forget what was before a new goal or a jump."""
        if self._newest_epoch != self._acted_epoch or self._anew:
            self._acted_epoch, self._anew = self._newest_epoch, False
            self._convergence.reset()
            self.loop.reset()

    def _inputs(self, measurement: Measurement) -> Inputs:
        state = self._newest_state if measurement is self.newest else self._state_of(measurement)
        return self.loop.inputs(state, self.readings, measurement.stamp_ns)

    def _state_of(self, measurement: Measurement) -> State:
        """What the task takes of a measurement, shapes (1,)."""
        it = measurement.state
        rigid = RigidBodyState(
            it.position_in_world[None],
            it.quat_xyzw[None],
            it.velocity_in_world[None],
            it.angular_velocity_in_body[None],
        )
        return self.loop.task.state_type.from_rigid(rigid)

    @property
    def _stops(self) -> bool:
        """Whether a robot that may not act is stopped by the backup of its envelope guard: it was under way."""
        flags, guard = self._flags, self.loop.envelope
        return guard is not None and guard.stops and flags.has_goal and not flags.bearing_off

    def _brake(self) -> np.ndarray | None:
        """The guard's command for a robot that may not act and would enter a volume within a minute, shape (1, m)."""
        guard, state = self.loop.keep_out, self._newest_state
        if guard is None:
            return None
        return guard.brake(state) if guard.holds(state)[0] or guard.drifts_in(state) else None

    def _follow_switch(self, before: Standby) -> bool:
        changed = self.switch.current is not before
        if changed:
            self.loop.use(self.switch.current.controller)
            self._convergence.reset()
        return changed

    def _arbitrate(self, now_ns: int) -> Decision:
        """An e-stop takes the goal away: after it, nothing moves by itself."""
        stopped = self._estop.reason(now_ns)
        if stopped and self._estop.received:
            if self.mission.goal_stamp_ns:
                self.refusal = Refusal(self.mission.goal_stamp_ns, stopped)
            self.mission.drop()
            self._follow_mission()
            self._change(outside=self._outside(), unconverged="", rests=True)
        self._change(estop=stopped, active_s=self.acted * self._control_ns / 1e9)
        decision = arbitrate(self._flags, now_ns)
        self._heed_distance(decision)
        return decision

    def _heed_distance(self, decision: Decision) -> None:
        """Report a goal that lies beyond the geofence; not one that was followed before the robot was carried away."""
        number, stamp_ns = self.mission.goals_received, self.mission.goal_stamp_ns
        if decision.may_act:
            self._followed = number
        if BEYOND_GEOFENCE not in decision.reason or number == self._followed:
            self.too_far = Refusal()
        elif self.too_far.stamp_ns != stamp_ns or not self.too_far.reason:
            self.too_far = Refusal(stamp_ns, decision.reason)

    def _follow_mission(self, **changes: object) -> None:
        """Let the flags say what the mission lacks, and how far its goal is away."""
        distance = float("inf")
        if self.newest is not None:
            distance = self.mission.distance(self._newest_state)
        lacking = self.mission.lacking
        self._change(has_goal=not lacking, lacking=lacking, goal_distance=distance, **changes)

    def _outside(self) -> str:
        """How the robot is outside its area right now; empty if it is not, or if its place is unknown."""
        if self.newest is None or not self._bounded:
            return ""
        guard = self.loop.envelope
        guarded = guard is not None and guard.stops and self._flags.has_goal
        place = self.newest.state.position_in_world.tolist()
        return outside(place, self._settings.area, guarded=guarded)

    def _beyond(self, goal: Goal) -> str:
        """How a goal lies outside the area or within a keep-out volume; empty if it does not, or is no place."""
        if self.loop.task.goal_topic == "goal_velocity":
            return ""
        problem = self.loop.task.goal_problem(goal.targets) or unreachable(
            "the goal", goal.targets.tolist(), self._settings.area, farthest_goal(self.loop.robot)
        )
        return problem and OUT_OF_BOUNDS + problem

    def _change(self, **changes: object) -> None:
        for name, value in changes.items():
            setattr(self._flags, name, value)


def _strives(controller: Controller) -> bool:
    """Whether a controller means to meet the goal; those that excite a robot, or rest, do not."""
    return not isinstance(controller, Excite | ExciteWheels | Rest)
