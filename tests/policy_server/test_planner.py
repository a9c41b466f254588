"""The planner as a controller: what it does with a course, without one, and when plans fail or come late."""

from __future__ import annotations

import time
from concurrent.futures import Future
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config import load_config
from fulmar_core.controllers.course import progressed, tell_course
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.metrics import Judge
from fulmar_core.robot import load_robot
from fulmar_core.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from policy_server.planning.loading import settings_path
from policy_server.planning.planner import _PATIENCE_S, Planner
from policy_server.planning.settings import PlannerSettings
from policy_server.policy import Policy
from policy_server.shipped import shipped_policy

ROBOT, TASK = load_robot("kingfisher"), load_task("go_through_positions")
SETTINGS = replace(load_config(PlannerSettings, settings_path("kingfisher")), width=2, tries=4, solved=1)
SEED = 41


def policy():
    return Policy(shipped_policy("kingfisher", "go_through_positions"), ROBOT, TASK)


def simulated(worlds, scenario="nominal"):
    return BatchSimulation(ROBOT, TASK, load_scenario(scenario), worlds=worlds, seed=SEED)


def drive(controller, simulation, steps=600, *, tell=True):
    """Waypoints passed, and every command."""
    controller.reset()
    commands = []
    for _ in range(steps):
        if tell:
            tell_course(controller, simulation.goal)
        commands.append(np.asarray(controller.act(simulation.observe())))
        simulation.goal = progressed(controller, simulation.goal)
        simulation.step(commands[-1])
    return np.asarray(simulation.goal.done), np.array(commands)


class Planless:
    """In place of the thread that plans: never ready, or ready with nothing; keeps what is ordered and what it gave."""

    def __init__(self, *, ready):
        self.ready, self.orders, self.given = ready, [], []

    def begin(self, orders):
        self.orders.append(orders)
        plans = Future()
        self.given.append(plans)
        if self.ready:
            plans.set_result([None] * len(orders))
        return plans


@pytest.fixture(scope="module")
def planner():
    return Planner(ROBOT, TASK, policy, SETTINGS)


@pytest.mark.slow
def test_it_passes_more_waypoints_than_the_policy_that_it_begins_from(planner):
    alone, _ = drive(policy(), simulated(8))
    planned, commands = drive(planner, simulated(8))
    assert planned.mean() > 1.03 * alone.mean()
    assert np.isfinite(commands).all() and np.abs(commands).max() <= 1.0


@pytest.mark.slow
def test_what_it_does_for_one_boat_does_not_depend_on_the_others(planner):
    _, one = drive(planner, simulated(1), 60)
    _, three = drive(planner, simulated(3), 60)
    np.testing.assert_allclose(three[:, :1], one, atol=1e-6)


def test_without_a_course_it_does_as_its_policy(planner):
    _, alone = drive(policy(), simulated(2), 30)
    _, untold = drive(planner, simulated(2), 30, tell=False)
    np.testing.assert_array_equal(untold, alone)


def test_a_course_too_short_to_know_ones_place_from_is_left_to_the_policy(planner):
    seen = simulated(1).observe()[0]
    planner.reset()
    planner.hear_course(np.zeros((2, 2)))
    np.testing.assert_array_equal(planner.act(seen), policy().act(seen))


@pytest.mark.parametrize("patient", [True, False], ids=["no plan is found", "every plan is late"])
def test_without_plans_it_goes_on_as_its_policy_would(patient, monkeypatch):
    planner = Planner(ROBOT, TASK, policy, SETTINGS, patient=patient)
    nothing = Planless(ready=patient)
    monkeypatch.setattr(planner, "_planning", nothing)
    done, _ = drive(planner, simulated(2), 300)
    alone, _ = drive(policy(), simulated(2), 300)
    assert (done >= alone - 1).all() and done.min() >= 3
    assert 7 <= len(nothing.orders) <= 16  # every 4 s, and again for a boat that lost its way


def test_what_nobody_waits_for_any_more_keeps_no_later_plan_waiting(monkeypatch):
    planner = Planner(ROBOT, TASK, policy, SETTINGS, patient=False)
    busy = Planless(ready=False)
    monkeypatch.setattr(planner, "_planning", busy)
    drive(planner, simulated(1), 60)
    late, coming = busy.given
    assert late.cancelled() and not coming.cancelled()
    planner.reset()
    assert coming.cancelled()


def carry_off(simulation, row, metres):
    x = np.array(simulation.truth.x)
    x[row] += metres
    simulation.truth.write(slice(None), replace(simulation.truth, x=x))
    simulation.step(np.zeros((len(x), 2)))


@pytest.mark.parametrize("patient", [True, False])
def test_a_lost_boat_leaves_no_plan_behind_but_one_that_others_wait_for(patient, monkeypatch):
    planner = Planner(ROBOT, TASK, policy, SETTINGS, patient=patient)
    busy = Planless(ready=False)
    monkeypatch.setattr(planner, "_planning", busy)
    monkeypatch.setattr("policy_server.planning.planner._PATIENCE_S", 0.0)
    simulation = simulated(2)
    drive(planner, simulation, 5)
    for row, given_up in ((0, []), (0, [1]), (1, [0, 1])):
        carry_off(simulation, row, 2.0)
        tell_course(planner, simulation.goal)
        planner.act(simulation.observe())
        assert [number for number, plans in enumerate(busy.given) if plans.cancelled()] == given_up


def test_in_real_time_no_step_waits_for_a_plan(monkeypatch):
    planner = Planner(ROBOT, TASK, policy, SETTINGS, patient=False)
    monkeypatch.setattr(planner, "_planning", Planless(ready=False))
    simulation = simulated(1)
    took = []
    for _ in range(100):
        tell_course(planner, simulation.goal)
        seen = simulation.observe()
        began = time.perf_counter()
        command = planner.act(seen)
        took.append(time.perf_counter() - began)
        simulation.step(command)
    assert np.median(took) < 0.5 * _PATIENCE_S


def test_a_boat_that_is_carried_off_begins_anew_from_where_it_is(planner, monkeypatch):
    nothing = Planless(ready=True)
    monkeypatch.setattr(planner, "_planning", nothing)
    simulation = simulated(1)
    drive(planner, simulation, 10)
    assert len(nothing.orders) == 1
    simulation.truth.write(slice(None), replace(simulation.truth, x=simulation.truth.x + 2.0))
    simulation.step(np.zeros((1, 2)))
    tell_course(planner, simulation.goal)
    planner.act(simulation.observe())
    assert len(nothing.orders) == 2
    (first,), (second,) = nothing.orders
    nearer_to_the_middle = SETTINGS.caution * first.reach
    assert second.reach == pytest.approx(nearer_to_the_middle)


def test_a_boat_that_is_read_further_away_than_carried_is_believed_to_be_there(planner, monkeypatch):
    monkeypatch.setattr(planner, "_planning", Planless(ready=True))
    simulation, by = simulated(1, "ideal"), 0.5 * (SETTINGS.carried + SETTINGS.lost)
    drive(planner, simulation, 10)
    carry_off(simulation, 0, by)
    tell_course(planner, simulation.goal)
    planner.act(simulation.observe())
    assert planner._estimator._states[0, 0] == pytest.approx(simulation.truth.x[0], abs=0.1 * by)


def test_another_course_begins_anew_and_a_reset_forgets_it(planner, monkeypatch):
    nothing = Planless(ready=True)
    monkeypatch.setattr(planner, "_planning", nothing)
    simulation = simulated(1)
    places = np.asarray(simulation.goal.targets)[..., :2]
    planner.reset()
    for course in (places, places, places[:, ::-1]):
        planner.hear_course(course)
        planner.act(simulation.observe())
    assert len(nothing.orders) == 2
    planner.reset()
    np.testing.assert_array_equal(planner.act(simulation.observe()), policy().act(simulation.observe()))


def test_it_says_which_waypoint_comes_next_on_its_own_course_alone(planner, monkeypatch):
    monkeypatch.setattr(planner, "_planning", Planless(ready=True))
    simulation = simulated(2)
    places = np.asarray(simulation.goal.targets)[..., :2]
    planner.reset()
    assert planner.coming(places) is None
    drive(planner, simulation, 100)
    np.testing.assert_array_equal(planner.coming(places), simulation.goal.done % places.shape[1])
    assert simulation.goal.done.min() >= 1
    assert planner.coming(places[:, ::-1]) is None


def test_on_a_course_that_passes_the_same_places_again_it_counts_as_the_judge_does(planner, monkeypatch):
    monkeypatch.setattr(planner, "_planning", Planless(ready=True))
    simulation = simulated(1, "ideal")
    once = np.array([[2.0, 0.0, 0.0], [3.0, 2.0, 2.0], [0.5, 2.5, -2.0]])
    simulation.goal = replace(
        simulation.goal, targets=np.tile(once, (3, 1))[None].astype(simulation.goal.targets.dtype)
    )
    judge = Judge(TASK, simulation.goal, simulation.control_dt)
    planner.reset()
    for _ in range(250):
        tell_course(planner, simulation.goal)
        command = planner.act(simulation.observe())
        simulation.goal = progressed(planner, simulation.goal)
        simulation.step(command)
        goals = np.asarray(judge.see(simulation.truth, None).done)
        assert abs(int(simulation.goal.done[0]) - int(goals[0])) <= 1
    assert goals[0] >= 4


@pytest.mark.parametrize(
    "changed",
    [
        {"settings": replace(SETTINGS, lost=0.4)},
        {"task": replace(TASK, reach=0.1)},
        {"robot": replace(ROBOT, body=replace(ROBOT.body, mass=1.01 * ROBOT.body.mass))},
    ],
    ids=lambda changed: next(iter(changed)),
)
def test_its_hash_changes_with_whatever_its_commands_depend_on(planner, changed):
    told = {"robot": ROBOT, "task": TASK, "make_policy": policy, "settings": SETTINGS} | changed
    assert Planner(**told).metadata()["sha256"] != planner.metadata()["sha256"]


def test_it_says_whose_policy_it_begins_from(planner):
    assert planner.metadata()["policy_sha256"] == policy().metadata()["sha256"]
