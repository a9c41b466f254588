"""A controller goes through a recorded run again, without ROS, in the guarded loop of the controller node.

What it is shown is what was recorded: each answer is compared with the recorded one, and the next step goes on from the
record, not from the new answer. So one different command does not make everything after it different.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fulmar_bags.control_steps import ControlSteps
from fulmar_bags.controller_changes import ControllerChange
from fulmar_bags.recorded_estop import RecordedEstop
from fulmar_bags.wire_reader import ABSENT, Received
from fulmar_core.config.errors import BagError, ConfigError, FulmarError, RunFailed, TaskError
from fulmar_core.controllers.controller import Controller, Inputs
from fulmar_core.controllers.law import Law
from fulmar_core.estimators.actuator_health.applied import AppliedHistory
from fulmar_core.loop.control_loop import readings_for, unknown_inputs
from fulmar_core.loop.fallback import ControllerSwitch, Standby, warm_up
from fulmar_core.loop.guarded_loop import GuardedLoop
from fulmar_core.loop.newest_readings import NewestReadings
from fulmar_core.safety.envelope.event import Event
from fulmar_core.safety.envelope.guard import EnvelopeGuard
from fulmar_core.safety.input_gate import InputGate, Measurement
from fulmar_core.safety.keep_apart import OLD_NS
from fulmar_core.states.rotation import rotate
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks.observation import Observer

FROM = ("observations", "odometry")
NEVER_S = 1e9  # input timeout of a record, which has no steady clock [s]


@dataclass(frozen=True)
class Answers:
    """What a controller said to each step of a record; NaN where it was not asked."""

    observations: np.ndarray  # (n, k) what it was shown
    observation_names: tuple[str, ...]
    actions: np.ndarray  # (n, m) before limits
    commands: np.ndarray  # (n, m) after limits; the safe one where it was not asked
    acted: np.ndarray  # (n,)
    reasons: tuple[str, ...]  # why it was not asked, by step; empty where it was
    trips: tuple[Event, ...] | None = None  # and returns of the envelope guard; None: not known


def rerun(
    record: ControlSteps,
    controller: Controller,
    *,
    source: str = "observations",
    fallback: Controller | None = None,
    load: Callable[[ControllerChange], Controller] | None = None,
    envelope: EnvelopeGuard | None = None,
) -> Answers:
    """Let a controller answer a recorded run, under the guards that the run had.

    Args:
        record: The run.
        controller: Made anew; warmed up or not.
        source: `observations` shows what was recorded; `odometry` makes observations anew, with the node's gates. Laws
            read the measured state, which is that of the odometry either way.
        fallback: Takes over where the node would have let it; warmed up here.
        load: Loads what took over, to follow the recorded changes of controller; None follows none.
        envelope: Guards in the place of the run's own such guard; then the controller is asked where it was in the
            record, whatever the other guards would say now.

    Returns:
        Its answers.

    Raises:
        BagError: The bag lacks what the source or a guard needs, its observations are another controller's, or a
            controller that took over is another one by now.
        RunFailed: The controller raises and nobody takes over; with the step.
    """
    if source == "observations":
        _check_observations(record, controller)
        if isinstance(controller, Law) and not len(record.odometry):
            raise BagError(f"the bag holds no odometry, which '{controller.name}' reads.")
    elif not len(record.odometry):
        raise BagError("the bag holds no odometry to make observations from. Use --from observations.")
    return _Rerun(record, controller, source, fallback, load, envelope).run()


def _check_observations(record: ControlSteps, controller: Controller) -> None:
    if not record.observation_names:
        raise BagError("the bag holds no observations. Use --from odometry to make them anew.")
    names = Observer(record.robot, record.task).names
    if record.observation_names != names:
        gone = [name for name in record.observation_names if name not in names]
        new = [name for name in names if name not in record.observation_names]
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
    """One pass: feeds the record to the loop that a controller node runs."""

    def __init__(
        self,
        record: ControlSteps,
        controller: Controller,
        source: str,
        fallback: Controller | None,
        load: Callable[[ControllerChange], Controller] | None,
        envelope: EnvelopeGuard | None,
    ) -> None:
        self._record, self._source, self._load = record, source, load
        self._robot, self._states = record.robot, _States(record)
        # Which steps were gated is known of lock step alone: in real time it hangs on when messages came.
        own = envelope is None
        self._gated = own and source == "odometry" and (record.settings.lockstep or not record.own)
        self._estop = RecordedEstop(record.presses, required=self._gated and record.settings.estop)
        self._history = AppliedHistory(record.settings.hold_ns(record.robot))
        self._states_fed = 0  # states of the actuators that the history has taken
        settings = replace(record.settings, input_timeout_s=NEVER_S)
        self._guard = GuardedLoop(
            record.robot,
            record.task,
            settings,
            ControllerSwitch(
                Standby(controller, "", ""),
                warm_up(fallback, record.robot, record.task) if fallback else None,
            ),
            self._estop,
            gate=InputGate(record.robot.limits, frozen_after=0),
            applied=self._history if len(record.applied) else None,
            envelope=envelope,
        )
        known = [each.controller for each in self._guard.switch.known]
        names = readings_for(record.robot, record.task, known)
        self._readings = NewestReadings(record.robot, names, in_step=record.settings.lockstep)
        if any(kind.image for kind in self._readings.kinds.values()):
            raise ConfigError(
                f"controller '{controller.name}' acts on images, which bags pack with losses. It would command "
                "something else. Fly it anew: fulmar run or fulmar evaluate --through mujoco."
            )
        self._to_read = {name: deque(record.readings(kind)) for name, kind in self._readings.kinds.items()}
        self._apart = deque(record.neighbours())
        self._others: Received | None = None  # the newest of them that had come
        # Of a robot without a bearing, and in a bag that says nothing of it, there is none to wait for.
        self._guard.take_bearing(not record.bearing or bool(record.bearing[0].value))
        self._guard.activate()
        self._fed = 0
        self._brakes = (
            False  # whether the backup of the envelope guard has answered since the controller was asked
        )

    def run(self) -> Answers:
        record, count, guard = self._record, len(self._record), self._guard
        actuators = len(self._robot.actuators.names)
        names = guard.loop.observer.names
        shown = np.full((count, len(names)), np.nan)
        safe = self._robot.actuators.safe_command
        actions, commands = np.full((count, actuators), np.nan), np.tile(safe, (count, 1)).astype(float)
        acted, reasons = np.zeros(count, dtype=bool), [""] * count
        goals = record.before(record.goals)
        bearing = record.before(record.bearing)
        obstacles = record.before(record.obstacles)
        things = {name: record.before(poses) for name, poses in record.things.items()}
        changes = record.changes_by_step() if self._load else {}
        guard.loop.controller.reset()
        for step in range(count):
            for message in obstacles.get(step, ()):
                guard.take_obstacles(message.value, message.stamp_ns)
            for name, poses in things.items():
                for message in poses.get(step, ()):
                    guard.take_thing(name, message.value, message.stamp_ns)
            for message in bearing.get(step, ()):
                guard.take_bearing(bool(message.value))
            for message in goals.get(step, ()):
                guard.take_goal(message.value, message.stamp_ns, message.log_ns)
            for message in changes.get(step, ()):
                guard.switch.propose(self._successor(message.value))
            guard.switch_controller()
            reasons[step], inputs = self._inputs(step)
            if inputs is None:
                commands[step] = guard.loop.previous[0]  # the safe one, or that of the keep-out guard
            else:
                try:
                    done = guard.act(inputs)
                    guard.watch(inputs, done)
                except Exception as error:  # noqa: BLE001 - whatever a controller raises, as in the node
                    reasons[step] = self._give_up(step, error)
                else:
                    acted[step], shown[step], commands[step] = True, inputs.observation[0], done.command[0]
                    if done.action.shape == done.command.shape:
                        actions[step] = done.action[0]
                    guard.note(done.refusal)
            recorded = record.commands[step]
            if not np.isnan(recorded).any():
                guard.loop.previous = recorded[None]
        if not record.own and guard.mission.lacking:  # in a bag of our own, it belongs to the run
            raise self._goalless()
        trips = () if guard.loop.envelope is None else tuple(guard.loop.envelope.events)
        return Answers(shown, names, actions, commands, acted, tuple(reasons), trips)

    def _inputs(self, step: int) -> tuple[str, Inputs | None]:
        """Why the controller is not asked at a step, and else what it acts on."""
        record, guard = self._record, self._guard
        log_ns, stamp, recorded = (
            int(record.log_ns[step]),
            int(record.stamp_ns[step]),
            bool(record.acted[step]),
        )
        self._feed_odometry(step)
        self._feed_applied(stamp)
        self._feed_readings(stamp, log_ns)
        self._estop.recorded = recorded
        sample = int(record.sample[step])
        state = self._states[sample] if sample != ABSENT else None
        measurement = None if state is None else Measurement(stamp, "odom", "base_link", state)
        if self._gated:
            if measurement is None:
                guard.loop.rest(stamp)
                return "no odom yet. Is the plant running?", None
            decision, inputs = guard.begin_step(measurement, log_ns)
            return decision.reason, inputs
        if self._estop.received and not recorded:
            guard.mission.drop()
        self._brakes = not recorded and (self._brakes or self._moved(step))
        if measurement is not None and self._brakes:
            guard.brake(measurement)
            return "the guard braked in the record", None
        if not recorded or (self._source == "odometry" and measurement is None):
            guard.loop.rest(stamp)
            return "not asked in the record", None
        return "", self._inputs_as_recorded(step, measurement)

    def _moved(self, step: int) -> bool:
        """Whether the backup of the envelope guard moved a robot that was not driven; nothing else does."""
        loop, recorded = self._guard.loop, self._record.commands[step]
        moved = not np.isnan(recorded).any() and bool((recorded != self._robot.actuators.safe_command).any())
        return moved and loop.envelope is not None and loop.keep_out is None

    def _inputs_as_recorded(self, step: int, measurement: Measurement | None) -> Inputs:
        """What a controller acts on that was asked in the record, whatever its guards would say now."""
        loop, stamp = self._guard.loop, int(self._record.stamp_ns[step])
        if measurement is not None and loop.goal is not None:
            inputs = self._guard.observe(measurement)
        elif self._source == "odometry":
            raise self._goalless()
        else:
            inputs = unknown_inputs(loop, stamp)
        if self._source == "observations":
            inputs = replace(
                inputs, observation=np.asarray(self._record.observations[step], dtype=float)[None]
            )
        return inputs

    def _feed_odometry(self, step: int) -> None:
        """Take all odometry up to that of a step, as the node's subscription does."""
        record, last = self._record, int(self._record.sample[step])
        while self._fed <= last:
            index = self._fed
            self._fed += 1
            frame, child = record.odometry.frame[index], record.odometry.child_frame[index]
            if not record.own:  # others name their frames as they please
                frame, child = "odom", "base_link"
            stamp = int(record.odometry.stamp_ns[index])
            if record.settings.lockstep and index and stamp == int(record.odometry.stamp_ns[index - 1]):
                continue  # the plant asked again, and had the same answer
            measurement = Measurement(stamp, frame, child, self._states[index])
            self._guard.take(measurement, int(record.log_ns[step]))

    def _feed_applied(self, stamp_ns: int) -> None:
        """Take all states of the actuators up to a measurement [ns]."""
        states = self._record.applied
        while self._states_fed < len(states) and states.stamp_ns[self._states_fed] < stamp_ns:
            index = self._states_fed
            self._states_fed += 1
            self._history.add(int(states.stamp_ns[index]), states.values[index])

    def _feed_readings(self, stamp_ns: int, log_ns: int) -> None:
        """Take what else was measured up to a step: in lock step it waited for that, in real time it had come [ns]."""
        lockstep = self._record.settings.lockstep
        for name, waiting in self._to_read.items():
            while waiting and (waiting[0].stamp_ns <= stamp_ns if lockstep else waiting[0].log_ns <= log_ns):
                received = waiting.popleft()
                self._readings.take(name, received.value, received.stamp_ns)
        while self._apart and (
            self._apart[0].stamp_ns <= stamp_ns if lockstep else self._apart[0].log_ns <= log_ns
        ):
            self._others = self._apart.popleft()
        others = self._others
        known = others is not None and stamp_ns - others.stamp_ns <= OLD_NS
        seen = others.value if others is not None and known else {}
        self._guard.readings = {**self._readings.at(stamp_ns), **seen}

    def _goalless(self) -> BagError:
        what, task = self._guard.mission.lacking, self._record.task.name
        return BagError(f"the bag holds no {what} for '{task}'. Give --goal x,y,deg.")

    def _give_up(self, step: int, error: Exception) -> str:
        """Let the fallback take over from a controller that raised, and say why the step has no answer."""
        if isinstance(error, TaskError):
            raise error
        name = self._guard.loop.controller.name
        reason = f"'{name}' raised {type(error).__name__} at step {step}: {error}"
        if not self._guard.fall_back(reason):
            raise RunFailed(reason) from error
        return reason

    def _successor(self, change: ControllerChange) -> Standby:
        """The controller that took over in the record."""
        assert self._load is not None
        where = f"the run went on with {change.what}"
        try:
            found = warm_up(self._load(change), self._robot, self._record.task)
        except FulmarError as error:
            raise BagError(f"{where}, which cannot be loaded: {error}") from error
        if found.sha256 != change.sha256:
            raise BagError(
                f"{where}, which is another one by now. Ask one controller: --controller or --policy."
            )
        return found


class _States:
    """The state of each odometry message, made when it is asked for."""

    def __init__(self, record: ControlSteps) -> None:
        seen = record.odometry
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
