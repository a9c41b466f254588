"""The two loops of a plant: lock step with a controller, and real time by the clock."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import numpy as np

from fulmar_core.config.errors import LockstepError
from fulmar_core.config.process import PLANT_PRIORITY, take_priority
from fulmar_core.controllers.flight_refuge import refuge_of
from fulmar_core.estimators.actuator_health.feedback_check import ActuatorFeedback
from fulmar_core.robots.actuators.refuge import DOWN
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.command_end import TakesEnds
from fulmar_core.simulation.backend import AirBearing, Backend, Sample
from fulmar_ros.deadline import Deadlines
from fulmar_ros.pace import ALWAYS, Pace
from fulmar_ros.plant_clock import SimulatedTime, WallTime
from fulmar_ros.plant_wires import PlantWires

RESEND_S = 0.5
OnStep = Callable[[Sample, np.ndarray], None]  # the sample after a step, and the command of the step


class LockstepLoop:
    """Steps a backend with a controller that lives in another process."""

    def __init__(
        self,
        backend: Backend,
        wires: PlantWires,
        guard: ActuatorGuard,
        clock: SimulatedTime | WallTime,
        *,
        control_hz: float,
        answer_timeout_s: float,
        publish_bearing: Callable[[], None] = lambda: None,
        feedback: ActuatorFeedback | None = None,
        pace: Pace = ALWAYS,
    ) -> None:
        """Step a simulator at `control_hz` [Hz], waiting at most `answer_timeout_s` [s] for each command.

        `publish_bearing` publishes the state of the air bearing, and waits until every subscriber has it; `feedback`
        compares what is applied with what is measured; `pace` says when a step may begin.
        """
        self._backend, self._wires, self._guard, self._clock = backend, wires, guard, clock
        self._pace = pace
        self._bearing = (
            backend if isinstance(backend, AirBearing) else None
        )  # asking takes as long as a sensor
        robot: Robot = backend.robot
        self._substeps = robot.timing.substeps(control_hz)
        self._dt = self._substeps * robot.timing.physics_dt
        self._answer_timeout_s = answer_timeout_s
        self._publish_bearing, self._feedback = publish_bearing, feedback
        self._bearing_on: bool | None = None  # as it was published
        self._commanded = True  # whether a command came for the step that is under way
        self.steps = 0  # that a command came for

    def run(
        self, sample: Sample, steps: int | None, stop: threading.Event, on_step: OnStep | None = None
    ) -> None:
        """Step from the first sample of an episode until `steps` are done, None for no end, or `stop` is set.

        Raises:
            LockstepError: If an answer does not come in time.
        """
        done = 0
        while not stop.is_set() and (steps is None or done < steps):
            if self._pace.paused:  # who steps it sees what each step led to
                self._wires.publish_truth(sample, self._clock.now_ns)
            self._pace.wait(stop)
            command = self._exchange(sample, stop)
            if command is None:
                return
            sample = self._step(command)
            done += 1
            self.steps += self._commanded
            if on_step is not None:
                on_step(sample, command)
        # The last state needs no answer, but belongs into the bag.
        self._wires.publish_truth(sample, self._clock.now_ns)

    def _step(self, command: np.ndarray) -> Sample:
        sample = self._backend.step(command, self._substeps)
        self._compare(command, self._dt, sample)
        self._clock.advance(self._dt)
        return sample

    def _compare(self, command: np.ndarray, seconds: float, sample: Sample) -> None:
        _compare(self._feedback, self._guard, self._wires, command, seconds, sample)

    def _exchange(self, sample: Sample, stop: threading.Event) -> np.ndarray | None:
        stamp = self._clock.now_ns
        began = time.monotonic()
        grounded = self._update_bearing()
        before = self._wires.commands.answered_ns
        self._wires.publish_sample(sample, stamp)
        with self._wires.lock:
            while not self._wires.commands.wait_for_answer(stamp, RESEND_S):
                waited = time.monotonic() - began
                if stop.is_set():
                    return None
                if waited > self._answer_timeout_s:
                    raise LockstepError(
                        f"no command answers the odom of t = {stamp / 1e9:.2f} s for {waited:.1f} s "
                        f"(limit {self._answer_timeout_s:g} s): {self._why_unanswered(before)} Look at its output."
                    )
                # The first messages can get lost while endpoints still find each other: those of every sensor count.
                self._wires.repeat_sample(sample, stamp, whole=before is None)
            # The very command that answered: how long its answer or this thread took does not matter here.
            command = self._guard.answer(time.monotonic_ns(), sample.odometry, plant_ns=stamp)
        if grounded:
            command = self._backend.robot.actuators.safe_command  # what the backend does with any other
        self._wires.publish_applied(command, stamp)
        return command

    def _why_unanswered(self, before_ns: int | None) -> str:
        """What the plant received in the place of an answer; with the stamp that was answered before."""
        answered_ns = self._wires.commands.answered_ns
        if answered_ns is not None and answered_ns != before_ns:
            return f"the last command is stamped t = {answered_ns / 1e9:.2f} s. A command answers an odom by its stamp."
        refused = f" {self._guard.last_rejection}." if self._guard.last_rejection else ""
        return f"the controller is silent.{refused}"

    def _update_bearing(self) -> bool:
        """Publish a change of the air bearing before the state that it belongs to; returns whether it is off."""
        if self._bearing is None:
            return False
        on = self._bearing.bearing_on
        if on is not self._bearing_on:
            self._bearing_on = on
            self._publish_bearing()
        return not on


class ChainLoop(LockstepLoop):
    """Lock step with nodes between plant and controller, such as an estimator.

    The plant publishes the readings of every physics step of a control period, then what the period holds. Each node
    between answers once it has all its inputs, and the controller answers the odometry that comes of it.
    """

    def _step(self, command: np.ndarray) -> Sample:
        dt = self._backend.robot.timing.physics_dt
        sample = self._backend.step(command, begins=self._substeps)
        self._compare(command, dt, sample)
        self._clock.advance(dt)
        for _ in range(self._substeps - 1):
            self._wires.publish_tick(sample, self._clock.now_ns)
            sample = self._backend.step(command, begins=0)
            self._compare(command, dt, sample)
            self._clock.advance(dt)
        return sample

    def _exchange(self, sample: Sample, stop: threading.Event) -> np.ndarray | None:
        stamp, began, wires = self._clock.now_ns, time.monotonic(), self._wires
        grounded, before = self._update_bearing(), self._wires.commands.answered_ns
        wires.publish_period(sample, stamp)
        with wires.lock:
            while not wires.wait_for_period(stamp, RESEND_S):
                waited = time.monotonic() - began
                if stop.is_set():
                    return None
                if waited > self._answer_timeout_s:
                    raise LockstepError(self._silence(stamp, waited, before))
                wires.repeat_period()
            self._commanded = wires.commands.answered_ns == stamp
            command = self._guard.answer(time.monotonic_ns(), sample.odometry, plant_ns=stamp)
        if grounded:
            command = self._backend.robot.actuators.safe_command
        wires.begin_period()
        wires.publish_applied(command, stamp)
        return command

    def _silence(self, stamp: int, waited: float, before: int | None) -> str:
        """Which link of the chain is silent."""
        limit, silent = (
            f"for {waited:.1f} s (limit {self._answer_timeout_s:g} s)",
            self._wires.silent_nodes(stamp),
        )
        if silent:
            return (
                f"no answer to the readings up to t = {stamp / 1e9:.2f} s {limit}: {', '.join(silent)} "
                f"{'is' if len(silent) == 1 else 'are'} silent. Look at the output."
            )
        why = self._why_unanswered(before)
        return f"no command answers the odom of t = {stamp / 1e9:.2f} s {limit}: {why} Look at its output."


class UnansweredLoop:
    """Steps a simulator on after the process of its controller has ended, as fast as it goes.

    No command can come any more, so none is waited for. The guard is asked with the plant's own time in place of the
    wall clock's, from the last command on: watchdog and safe controller act at the ticks at which they would in real
    time, however long the process took to end.
    """

    def __init__(
        self, backend: Backend, wires: PlantWires, guard: ActuatorGuard, clock: SimulatedTime | WallTime
    ) -> None:
        """Step a simulator, tick by tick."""
        self._backend, self._wires, self._guard, self._clock = backend, wires, guard, clock

    def run(self, sample: Sample, ticks: int, stop: threading.Event, on_step: OnStep) -> None:
        """Tick from a sample until `ticks` are done, or `stop` is set."""
        dt, begun_ns, now_ns = self._backend.robot.timing.physics_dt, self._clock.now_ns, time.monotonic_ns()
        with self._wires.lock:
            began_ns = now_ns - self._guard.watchdog.silent_ns(now_ns)
            self._guard.refuge = refuge_of(self._backend.robot, 1.0 / dt)  # asked at ticks, not at commands
        for _ in range(ticks):
            if stop.is_set():
                return
            now_ns = self._clock.now_ns
            with self._wires.lock:
                command = self._guard.output(began_ns + now_ns - begun_ns, sample.odometry, plant_ns=now_ns)
            sample = self._backend.step(command)
            self._wires.publish_applied(command, now_ns)
            self._clock.advance(dt)
            on_step(sample, command)


class RealtimeLoop:
    """Steps a backend by the clock; the watchdog acts at every tick."""

    def __init__(
        self,
        backend: Backend,
        wires: PlantWires,
        guard: ActuatorGuard,
        clock: SimulatedTime | WallTime,
        *,
        rate: float,
        feedback: ActuatorFeedback | None = None,
        pace: Pace = ALWAYS,
    ) -> None:
        """Step a simulator or a robot; `rate` is simulated seconds a wall-clock second, > 0.

        `feedback` compares what is applied with what is measured; `pace` says when a tick may begin.
        """
        self._feedback, self._pace = feedback, pace
        self._fastest = self.rate = rate
        self._backend, self._wires, self._guard, self._clock = backend, wires, guard, clock
        self._ends = backend if isinstance(backend, TakesEnds) else None
        self._dt = backend.robot.timing.physics_dt
        self.period_s = self._dt / rate
        self.deadlines = Deadlines(self.period_s)
        self.ticks = 0
        self._ticked_ns: int | None = None

    def run(self, sample: Sample, ticks: int | None, stop: threading.Event, *, lands: bool = False) -> None:
        """Tick from the first sample until `ticks` are done, None for no end, or `stop` is set.

        A safe controller that brings the robot to the ground is not cut short by the last tick. `lands`: it begins to
        do so there.
        """
        take_priority(PLANT_PRIORITY)
        self._ticked_ns = time.monotonic_ns()
        self._wires.publish_sample(sample, self._clock.now_ns)
        while self._goes_on(ticks, lands=lands) and self.deadlines.wait(stop):
            if self._pace.paused:
                self._stand_still(stop)
                if stop.is_set():
                    return
            command, begun_ns = self._command(sample), self._clock.now_ns
            sample = self._backend.step(command)
            applied = command if sample.applied is None else sample.applied
            self._wires.publish_applied(applied, begun_ns)
            passed = 1 + sample.more_ticks
            _compare(self._feedback, self._guard, self._wires, applied, passed * self._dt, sample)
            self._clock.advance(passed * self._dt)
            self.ticks += passed
            self._ticked_ns = time.monotonic_ns()
            self._wires.publish_sample(sample, self._clock.now_ns)

    def _stand_still(self, stop: threading.Event) -> None:
        """Wait for the next step, or for the end of the pause; the silence of a controller does not grow meanwhile."""
        with self._wires.lock:
            self._guard.watchdog.hold(time.monotonic_ns())
        self._pace.wait(stop)
        with self._wires.lock:
            self._guard.watchdog.go_on(time.monotonic_ns())
        self.deadlines.begin_anew()

    def _goes_on(self, ticks: int | None, *, lands: bool) -> bool:
        if ticks is None or self.ticks < ticks:
            return True
        with self._wires.lock:
            if lands and not self._guard.handed_over:
                self._guard.hand_over(time.monotonic_ns())
                return True  # one tick more, by which the safe controller begins
            return self._guard.handed_over and self._guard.doing not in ("", DOWN)

    def change_rate(self, rate: float) -> str:
        """Tick at another rate from the next tick on, from any thread; returns why not."""
        if rate > self._fastest:
            return (
                f"'rate' is {rate:g}, at most {self._fastest:g}: the controller keeps the beat that it was started "
                "with, and would be too slow. Start both with --rate."
            )
        self.rate, self.period_s = rate, self._dt / rate
        self.deadlines.change(self.period_s)
        return ""

    def since_tick_s(self, now_ns: int) -> float:
        """Time since the last finished step, 0 before the first [s]; `now_ns` by the monotonic clock."""
        if self._pace.paused:
            self._ticked_ns = now_ns
        return 0.0 if self._ticked_ns is None else (now_ns - self._ticked_ns) / 1e9

    def _command(self, sample: Sample) -> np.ndarray:
        with self._wires.lock:
            self._wires.commands.take_arrived()
            self._guard.see_refusal(sample.refusal)
            now_ns = time.monotonic_ns()
            if self._ends is not None:
                self._ends.take_end(self._guard.end(now_ns))
            return self._guard.output(now_ns, sample.odometry, plant_ns=self._clock.steady_ns)


def _compare(
    feedback: ActuatorFeedback | None,
    guard: ActuatorGuard,
    wires: PlantWires,
    command: np.ndarray,
    seconds: float,
    sample: Sample,
) -> None:
    """Compare what was applied for a time [s] with what is measured; what fails for good is handed over."""
    if feedback is None:
        return
    feedback.see(command, seconds, sample)
    failed = feedback.grounds
    if failed is not None:
        stuck = None if failed.value is None else (failed.part, failed.value)
        with wires.lock:
            guard.fail(failed.words, wires.commands.steady_ns, stuck)
