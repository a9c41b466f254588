"""One control step: goal, observation, command, limits, and what is remembered from one to the next."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.controllers.classical import load_classical
from fulmar_core.estimators.actuator_health.applied import AppliedHistory
from fulmar_core.estimators.actuator_health.filters import HealthSettings
from fulmar_core.loop.control_loop import ControlLoop, unknown_inputs
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_at, stack_goals
from fulmar_core.tasks.observation import Observer

S, MS = 1_000_000_000, 1_000_000
BASE, PLATFORM = load_robot("turtlebot2"), load_robot("floating_platform")
WAYPOINTS, POSE = load_task("go_through_positions"), load_task("go_to_pose")
COURSE = goal_at((0.0, 0.0, 0.0), (3.0, 0.0, 0.0))[None]
GENTLE = (0.01, 0.02)  # within the slew of one step from rest
PERIOD_NS = round(S / BASE.timing.control_hz)


class Scripted:
    """Answers with what it is given, and counts resets."""

    name, estimator = "scripted", None
    readings, observer = (), None

    def __init__(self, answer=GENTLE, *, robot=BASE, estimator=None):
        self.control_hz, self.estimator = robot.timing.control_hz, estimator
        self.answer, self.resets, self.inputs = answer, 0, None

    def reset(self):
        self.resets += 1

    def act(self, inputs):
        self.inputs = inputs
        if isinstance(self.answer, Exception):
            raise self.answer
        answer = np.asarray(self.answer, dtype=float)
        return np.tile(answer, (len(inputs.previous), 1)) if answer.ndim == 1 else answer


def at(*x, y=0.0):
    place = np.array(x, dtype=float)
    return PlanarState(place, 0.0 * place + y, *(0.0 * place for _ in range(4)))


def loop_of(controller, *, task=WAYPOINTS, goal=COURSE, robot=BASE, **given):
    loop = ControlLoop(robot, task, controller, **given)
    loop.begin(goal)
    return loop


def test_a_step_gives_the_controller_what_was_measured_and_the_goal_as_it_is_seen():
    controller = Scripted()
    loop = loop_of(controller)
    step = loop.step(at(1.0), {}, 5 * S)
    inputs = controller.inputs
    np.testing.assert_array_equal(step.command, [GENTLE])
    assert inputs.state == at(1.0)
    assert (inputs.stamp_ns, inputs.dt, inputs.estimates) == (5 * S, 1.0 / BASE.timing.control_hz, None)
    np.testing.assert_array_equal(inputs.goal.current, [[0.0, 0.0, 0.0]])
    np.testing.assert_array_equal(
        step.observation, Observer(BASE, loop.task)(at(1.0), COURSE, np.zeros((1, 2)))
    )
    assert loop.answered_ns == 5 * S
    loop.step(at(1.0), {}, 5 * S + PERIOD_NS)
    np.testing.assert_array_equal(controller.inputs.previous, [GENTLE])


def test_a_target_is_done_at_the_step_that_measures_it_reached_and_that_step_sees_the_next():
    controller = Scripted()
    loop = loop_of(controller)
    seen = []
    for number, x in enumerate((1.0, 0.5, 0.05, 0.5)):
        loop.step(at(x), {}, number * PERIOD_NS)
        seen.append(float(controller.inputs.goal.current[0, 0]))
    assert seen == [0.0, 0.0, 3.0, 3.0]


def test_the_time_of_a_goal_begins_with_its_first_step_and_anew_with_another_goal():
    task = load_task("track_velocities")
    goal = goal_at((0.1, 0.0, 0.0), (0.2, 0.0, 0.0), (0.3, 0.0, 0.0))[None]
    loop = loop_of(Scripted(), task=task, goal=goal)
    hold = round(S * task.hold_s)
    for began in (100 * S, 200 * S):
        times = (began, began + hold - MS, began + hold)
        seen = [float(loop.inputs(at(0.0), {}, stamp).goal.current[0, 0]) for stamp in times]
        assert seen == [0.1, 0.1, 0.2]
        loop.begin(goal)


def test_each_robot_is_as_far_along_as_it_has_come_itself():
    loop = loop_of(Scripted(), goal=stack_goals([COURSE[0], COURSE[0]]), robots=2)
    loop.step(at(1.0, 1.0), {}, 0)
    step = loop.step(at(0.05, 0.5), {}, PERIOD_NS)
    assert loop.goal.done.tolist() == [1.0, 0.0]
    assert step.command.shape == (2, 2)


def test_a_goal_of_gates_begins_where_the_robot_is_measured():
    loop = loop_of(
        Scripted(), task=load_task("race_gates"), goal=goal_at((0.2, 0.0, 0.0), (3.0, 0.0, 0.0))[None]
    )
    for number, x in enumerate((0.4, 0.6)):  # behind the gate already, whatever was before the goal
        loop.step(at(x), {}, number * PERIOD_NS)
    assert loop.goal.done.tolist() == [0.0]


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        ((np.nan, 0.0), "command for actuator 1 is not finite"),
        ((0.0, np.inf), "command for actuator 2 is not finite"),
        ((0.0, 0.0, 0.0), r"command has shape (1, 3), must be (1, 2)"),
        (np.zeros((1, 1, 2)), r"command has shape (1, 1, 2), must be (1, 2)"),
    ],
)
def test_a_refused_action_becomes_the_safe_command_and_the_previous_one(answer, reason):
    controller = Scripted()
    loop = loop_of(controller)
    assert loop.step(at(1.0), {}, 0).command.any()
    controller.answer = answer
    step = loop.step(at(1.0), {}, PERIOD_NS)
    assert step.refusal == reason
    np.testing.assert_array_equal(step.command, [[0.0, 0.0]])
    np.testing.assert_array_equal(step.action.ravel()[: np.size(answer)], np.ravel(answer))
    np.testing.assert_array_equal(loop.previous, [[0.0, 0.0]])


def test_an_exception_of_a_controller_comes_through_and_leaves_the_safe_command_as_previous():
    controller = Scripted()
    loop = loop_of(controller)
    loop.step(at(1.0), {}, 0)
    controller.answer = RuntimeError("lost its way")
    with pytest.raises(RuntimeError, match="lost its way"):
        loop.step(at(1.0), {}, PERIOD_NS)
    np.testing.assert_array_equal(loop.previous, [[0.0, 0.0]])
    assert loop.answered_ns == PERIOD_NS


def test_a_command_is_cut_to_the_limits_and_to_what_the_actuators_reach_in_one_step():
    loop = loop_of(Scripted((100.0, -100.0)))
    slew = np.array(BASE.actuators.response.slew) * loop.dt
    first, second = (loop.step(at(1.0), {}, number * PERIOD_NS).command[0] for number in range(2))
    np.testing.assert_allclose(first, [slew[0], -slew[1]])
    np.testing.assert_allclose(second, [2.0 * slew[0], -2.0 * slew[1]])


@pytest.mark.parametrize(("gap_ns", "forgets"), [(500 * MS, False), (500 * MS + 1, True)])
def test_a_pause_lets_the_loop_forget_and_no_shorter_time_does(gap_ns, forgets):
    controller = Scripted()
    loop = loop_of(controller, pause_ns=500 * MS)
    loop.step(at(1.0), {}, S)
    before = controller.resets
    loop.step(at(1.0), {}, S + gap_ns)
    assert controller.resets - before == forgets
    np.testing.assert_array_equal(controller.inputs.previous, [(0.0, 0.0) if forgets else GENTLE])


def test_a_step_at_rest_answers_with_the_safe_command_without_the_controller():
    controller = Scripted()
    loop = loop_of(controller)
    loop.step(at(1.0), {}, 0)
    controller.inputs = None
    loop.rest(PERIOD_NS)
    assert controller.inputs is None
    assert (loop.previous.tolist(), loop.answered_ns) == ([[0.0, 0.0]], PERIOD_NS)


def test_inputs_of_an_unknown_state_and_goal_are_not_a_number():
    inputs = unknown_inputs(loop_of(Scripted()), 7 * S)
    assert all(np.isnan(getattr(inputs.state, name)).all() for name in PlanarState.COLUMNS)
    assert np.isnan(inputs.observation).all() and np.isnan(inputs.goal.current).all()
    assert inputs.observation.shape == (1, len(Observer(BASE, WAYPOINTS).names))
    assert (inputs.previous.tolist(), inputs.stamp_ns) == ([[0.0, 0.0]], 7 * S)


@pytest.mark.parametrize(("task", "numbers"), [("go_to_pose_3d", 7), ("track_velocities_3d", 6)])
def test_unknown_inputs_in_space_have_targets_of_their_space(task, numbers):
    robot = load_robot("spacecraft_16")
    loop = loop_of(Scripted(np.zeros(16), robot=robot), task=load_task(task), goal=None, robot=robot)
    assert np.isnan(unknown_inputs(loop, 0).goal.current).tolist() == [[True] * numbers]


# What an estimator learns from

ESTIMATOR, POSE_GOAL = HealthSettings(retry_s=0.0), goal_at((0.0, 0.0, 0.0))[None]
TICK_NS = 200 * MS


def steadfast(applied=None, steps=6, *, answer=(1.0, 0, 0, 0, 0, 1.0, 0, 0), estimator=ESTIMATOR):
    """A platform that does not move although its valves are commanded."""
    controller = Scripted(answer, robot=PLATFORM, estimator=estimator)
    loop = loop_of(controller, task=POSE, goal=POSE_GOAL, robot=PLATFORM, applied=applied, pause_ns=500 * MS)
    for number in range(steps):
        loop.step(at(1.0), {}, S + number * TICK_NS)
    return loop


def push_of(loop):
    return float(np.hypot(*loop.estimate.push[0, :2]))


def test_without_reports_of_the_actuators_commands_count_as_applied():
    assert push_of(steadfast()) > 0.3


def test_an_estimate_uses_what_the_actuators_report_and_not_what_was_commanded():
    applied = AppliedHistory(hold_ns=100 * MS)
    for stamp in range(0, 4000, 20):
        applied.add(stamp * MS, np.zeros(8))
    assert push_of(steadfast(applied)) < 0.01


def test_nothing_is_learned_while_reports_are_missing():
    loop = steadfast(AppliedHistory(hold_ns=100 * MS), steps=20)
    assert push_of(loop) == 0.0
    assert loop.estimate.health.effectiveness.min() > 0.9


def test_the_lqr_gets_its_estimates_from_the_loop():
    lqr = load_classical(PLATFORM, POSE, control_hz=5.0, law="lqr")
    loop = loop_of(lqr, task=POSE, goal=POSE_GOAL, robot=PLATFORM)
    for number in range(6):
        assert loop.step(at(1.0), {}, S + number * TICK_NS).command.any()
    assert push_of(loop) > 0.3  # believed to hold the platform against its open valves


@pytest.mark.parametrize("forget", ["reset", "pause", "use", "another estimator"])
def test_what_is_estimated_is_forgotten(forget):
    loop, stamp = steadfast(), S + 6 * TICK_NS
    if forget == "reset":
        loop.reset()
    elif forget == "pause":
        stamp += 600 * MS
    else:
        settings = ESTIMATOR if forget == "use" else HealthSettings(held=0.0)
        loop.use(Scripted(np.zeros(8), robot=PLATFORM, estimator=settings))
    loop.step(at(1.0), {}, stamp)
    assert push_of(loop) == 0.0


def test_a_controller_without_an_estimator_gets_no_estimate():
    loop = steadfast()
    other = Scripted(np.zeros(8), robot=PLATFORM)
    loop.use(other)
    loop.step(at(1.0), {}, S + 6 * TICK_NS)
    assert loop.controller is other
    assert other.inputs.estimates is None
    assert loop.estimate is None


class Smoothed:
    """An observer: halves of the state before and of the measured one."""

    def __init__(self):
        self.past = None

    def reset(self):
        self.past = None

    def update(self, measured, previous):
        x = measured.x if self.past is None else 0.5 * (self.past + measured.x)
        self.past = x
        return replace(measured, x=x)


def test_a_controller_acts_on_what_its_observer_believes_until_it_forgets():
    controller = Scripted()
    controller.observer = Smoothed()
    loop = loop_of(controller)
    seen = [loop.inputs(at(x), {}, stamp) for x, stamp in ((0.0, 0), (1.0, PERIOD_NS))]
    assert [inputs.believed.x[0] for inputs in seen] == [0.0, 0.5]
    assert seen[1].state.x[0] == 1.0
    loop.reset()
    assert loop.inputs(at(1.0), {}, 2 * PERIOD_NS).believed.x[0] == 1.0
