"""One control step from measurement to command, for nodes, re-runs, evaluation and identification."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fulmar_core.controllers.controller import Controller, Inputs, Readings
from fulmar_core.dynamics.by_kind import begin_of
from fulmar_core.estimators.actuator_health.actuator_estimator import ActuatorEstimate, ActuatorEstimator
from fulmar_core.estimators.actuator_health.applied import Applied, AppliedHistory
from fulmar_core.loop.formation import FormationGoal, ShapePlace
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.fuel import NAME as FUEL
from fulmar_core.safety.command_gate import command_problem
from fulmar_core.safety.envelope.guard import EnvelopeGuard
from fulmar_core.safety.fuel_reserve import gauges_of
from fulmar_core.safety.keep_apart import KeepApartGuard, Other
from fulmar_core.safety.keep_out import KeepOutGuard
from fulmar_core.states.state import State
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import Goal
from fulmar_core.tasks.observation import Observer, slewed

NEVER_NS = 1 << 62  # no pause is that long


@dataclass(frozen=True, slots=True)
class Step:
    """Outcome of one control step of n robots."""

    observation: np.ndarray  # shape (n, k)
    action: np.ndarray  # what the controller chose, of whatever shape
    command: np.ndarray  # the action after every limit; the safe one where it was refused, shape (n, m)
    refusal: str  # why the action was refused; empty if it was not


class ControlLoop:
    """Advances the goal by what was measured, observes, asks the controller, and limits and gates its command.

    Attributes:
        goal: Of all robots, leading shape (n,); None before there is one.
        previous: Command of the step before, after every limit, shape (n, m); where no controller chose one, the safe
            command, and from the next measurement on what actuators do by themselves.
        keep_out: Takes over from a controller that would enter a keep-out volume; None where the task has none.
        envelope: Takes over from a controller that would leave the robot's bounds; None without one.
        keep_apart: Bounds the speed towards other robots of a fleet; None where there are none to keep apart from.
        formation: Keeps the goal at a place about a leader; None without one.
        answered_ns: Stamp of the measurement that this was the answer to; -1 before the first [ns].
        estimate: Of the controller's actuator estimator at the newest step; None without one.
    """

    def __init__(
        self,
        robot: Robot,
        task: Task,
        controller: Controller,
        *,
        robots: int = 1,
        pause_ns: int = NEVER_NS,
        applied: AppliedHistory | None = None,
        envelope: EnvelopeGuard | None = None,
        others: Sequence[Other] = (),
        formation: ShapePlace | None = None,
    ) -> None:
        """Begin without a goal.

        Args:
            robot: The robot.
            task: What it does.
            controller: Chooses the commands.
            robots: n, how many of it run side by side.
            pause_ns: After a longer time without a command the past is forgotten [ns].
            applied: What the actuators of one robot did, as far as that is known; without it the loop takes commands
                for what was applied.
            envelope: Guard of the robot's bounds; none by default.
            others: Robots of a fleet that a guard keeps apart from this one.
            formation: Place about a leader, which is one of these, that takes the place of the targets of each goal.
        """
        self.envelope = envelope
        self.robot, self.task = robot, task.fitted(robot)
        self.observer = Observer(robot, self.task)
        self.dt = robot.timing.substeps(controller.control_hz) * robot.timing.physics_dt
        self._pause_ns, self._applied = pause_ns, applied
        volumes = self.task.keep_outs
        self.keep_out = KeepOutGuard(robot, volumes, self.dt) if volumes else None
        self.keep_apart = KeepApartGuard(robot, others, self.dt) if others else None
        names = [other.name for other in others]
        self.formation = None if formation is None else FormationGoal(formation, names, controller)
        self._safe = np.tile(np.asarray(robot.actuators.safe_command, dtype=float), (robots, 1))
        self.goal: Goal | None = None
        self._began_ns: int | None = None
        self.previous, self.answered_ns = self._safe, -1
        self._chosen = False  # whether the controller chose the previous command
        self._estimator = self._estimator_for(controller)
        self.estimate: ActuatorEstimate | None = None
        self._guard_estimate: ActuatorEstimate | None = None  # for the law of the envelope guard
        self._estimated_ns = -1
        self._controller = controller
        self._fuel: np.ndarray | None = None  # share of the tank by the newest reading, shape (n,)

    @property
    def controller(self) -> Controller:
        """The controller that chooses the commands."""
        return self._controller

    @property
    def estimates(self) -> bool:
        """Whether actuators are estimated, for the controller or for the backup of the envelope guard."""
        return self._estimator is not None

    def use(self, controller: Controller) -> None:
        """Let another controller go on; what is estimated begins anew."""
        if controller.estimator != self._controller.estimator:
            self._estimator = self._estimator_for(controller)
        self._controller = controller
        if self.formation is not None:
            self.formation.use(controller)
        self._forget_estimates()

    def begin(self, goal: Goal | None) -> None:
        """Take a new goal, leading shape (n,), or none; its time begins with the next step."""
        self.goal, self._began_ns = goal, None

    def reset(self) -> None:
        """Let controller and estimator forget the past: a new goal or episode, or time or place jumped."""
        self._controller.reset()
        if self._controller.observer is not None:
            self._controller.observer.reset()
        self._forget_estimates()
        for guard in (self.keep_out, self.keep_apart, self.formation):
            if guard is not None:
                guard.reset()

    def step(self, measured: State, readings: Readings, stamp_ns: int) -> Step:
        """Do one control step; see `inputs` and `act`."""
        return self.act(self.inputs(measured, readings, stamp_ns))

    def inputs(self, measured: State, readings: Readings, stamp_ns: int) -> Inputs:
        """Advance the goal by a measurement, and observe.

        Args:
            measured: State of each robot, shapes (n,).
            readings: What else is measured or estimated, see `Inputs.readings`.
            stamp_ns: When it was measured, on the plant's clock [ns].

        Returns:
            The controller's inputs.
        """
        if stamp_ns - self.answered_ns > self._pause_ns:
            self._chosen = False
            self.reset()
        first = measured.columns()[0]
        is_plain = isinstance(first, np.ndarray) and first.dtype == float
        state = measured if is_plain else measured.in_float64()
        if not self._chosen:
            self.previous = begin_of(self.robot).command(self.robot, state)
        goal = self._advanced(state, stamp_ns)
        if self.formation is not None:
            any_state: Any = state
            own = np.column_stack((any_state.x, any_state.y, any_state.yaw))
            self.goal, goal = self.formation.follow(goal, own, readings, stamp_ns)
        self._estimate(state, stamp_ns)
        if self.observer.sees_fuel and FUEL in readings:
            self._fuel = readings[FUEL][:, 1]
        observation = np.asarray(self.observer(state, goal, self.previous, self._fuel), dtype=float)
        return Inputs(
            state,
            goal,
            observation,
            self.previous,
            self.estimate,
            stamp_ns,
            self.dt,
            readings,
            self._believed(state),
        )

    def act(self, inputs: Inputs) -> Step:
        """Ask the controller, and limit and gate its command, which is the previous one from then on.

        Raises:
            Exception: Whatever the controller raises; then `previous` is as where no controller chose a command.
        """
        self.rest(inputs.stamp_ns)
        return self.take(inputs, self._controller.act(inputs))

    def take(self, inputs: Inputs, chosen: np.ndarray) -> Step:
        """Limit and gate an action (see `Controller.act`) that was chosen from these inputs."""
        action = np.asarray(chosen, dtype=float)
        fine = action.shape == self._safe.shape and np.isfinite(action).all()
        refusal = "" if fine else command_problem(action, self._safe.shape) or ""
        wanted = command = self._safe if refusal else action
        if self.keep_out is not None:
            wanted = self.keep_out.guarded(command, inputs)
        if self.keep_apart is not None:
            wanted = self.keep_apart.guarded(wanted, inputs)
        if not refusal or wanted is not command:
            command = slewed(self.robot.actuators.limited(wanted), inputs.previous, self.robot, self.dt)
        if self.envelope is not None and self.envelope.watches:
            sent = self.envelope.guarded(command, inputs, self._guard_estimate, self._fence_at(inputs.goal))
            if sent is not command:
                if self.keep_out is not None:  # the backup, too, stays out of these
                    sent = self.keep_out.guarded(sent, inputs)
                command = slewed(self.robot.actuators.limited(sent), inputs.previous, self.robot, self.dt)
        self.previous, self.answered_ns, self._chosen = command, inputs.stamp_ns, not refusal
        return Step(inputs.observation, action, command, refusal)

    def rest(self, stamp_ns: int, command: np.ndarray | None = None) -> None:
        """Answer a measurement without asking the controller [ns]; with the safe command unless a guard has another."""
        self.previous, self.answered_ns, self._chosen = self._safe, stamp_ns, command is not None
        if command is not None:
            self.previous = slewed(self.robot.actuators.limited(command), self.previous, self.robot, self.dt)

    def brake(self, measured: State, stamp_ns: int) -> None:
        """Answer a measurement by the backup of the envelope guard, which stops the robots and holds them.

        Args:
            measured: State of each robot, shapes (n,).
            stamp_ns: When it was measured, on the plant's clock [ns].
        """
        assert self.envelope is not None, "no envelope guard has a backup"
        state: Any = measured.in_float64()
        self._estimate(state, stamp_ns)
        unknown = unknown_inputs(self, stamp_ns)
        inputs = replace(unknown, state=state, previous=self.previous)
        wanted = self.envelope.stopped(inputs, self._guard_estimate)
        self.previous = slewed(self.robot.actuators.limited(wanted), self.previous, self.robot, self.dt)
        self.answered_ns, self._chosen = stamp_ns, True

    def _fence_at(self, goal: Goal) -> np.ndarray | None:
        """Where the goal is that a geofence surrounds, shape (n, 3); None where velocities are the goal [m]."""
        if self.task.goal_topic == "goal_velocity":
            return None
        place = np.zeros((len(goal.current), 3))
        axes = self.task.state_type.AXES
        place[:, :axes] = goal.current[:, :axes]
        return place

    def _advanced(self, state: State, stamp_ns: int) -> Goal:
        """The goal with those targets done that a measurement reaches."""
        assert self.goal is not None, "a control step needs a goal"
        if self._began_ns is None:
            self._began_ns = stamp_ns
            self.goal = self.task.begun(self.goal, state)
        else:
            time_s = np.asarray((stamp_ns - self._began_ns) / 1e9)
            self.goal = self.task.advance(self.goal, state, time_s)
        assert self.goal is not None
        return self.goal

    def _believed(self, state: Any) -> Any:
        """What the controller's observer makes of a measurement; None without one."""
        observer = self._controller.observer
        return None if observer is None else observer.update(state, self.previous)

    def _estimator_for(self, controller: Controller) -> ActuatorEstimator | None:
        settings = controller.estimator
        if settings is None and self.envelope is not None and self.envelope.watches:
            settings = self.envelope.backup.law.estimator
        return ActuatorEstimator(self.robot, settings) if settings is not None else None

    def _forget_estimates(self) -> None:
        if self._estimator is not None:
            self._estimator.reset()
        self.estimate = self._guard_estimate = None
        self._estimated_ns = -1

    def _estimate(self, state: Any, stamp_ns: int) -> None:
        """Update the estimate of a robot in the plane by what moved it since the last one."""
        passed_ns = stamp_ns - self._estimated_ns
        if self._estimator is None or passed_ns == 0:  # by the clock, one measurement may serve twice
            return
        applied: np.ndarray | Applied | None = None
        passed_s = self.dt
        if 0 < passed_ns <= self._pause_ns:
            applied, passed_s = self.previous, 1e-9 * passed_ns
            if self._applied is not None:
                applied = self._applied.between(self._estimated_ns, stamp_ns)
        self._guard_estimate = self._estimator.update(state, applied, passed_s)
        self.estimate = self._guard_estimate if self._controller.estimator is not None else None
        self._estimated_ns = stamp_ns


def readings_for(robot: Robot, task: Task, controllers: Iterable[Controller]) -> tuple[str, ...]:
    """Names of the readings that control steps take: those of the controllers, and of the guard of keep-out volumes."""
    guards = gauges_of(robot) if task.keep_outs else ()
    return tuple(dict.fromkeys([name for each in controllers for name in each.readings] + list(guards)))


def unknown_inputs(loop: ControlLoop, stamp_ns: int) -> Inputs:
    """Inputs of one robot whose state and goal are not known: NaN."""
    form = loop.task.state_type
    twist = loop.task.goal_topic == "goal_velocity"
    things = {thing.name: form.targets_of(np.full((1, 7), np.nan)) for thing in loop.task.things}
    target = form.targets_of(np.full((1, 1, 6 if twist else 7), np.nan))
    goal = Goal(target, np.zeros(1), np.zeros((1, 0, 3)), things)
    observation = np.full((1, len(loop.observer.names)), np.nan)
    return Inputs(form.unknown(), goal, observation, loop.previous, None, stamp_ns, loop.dt)
