"""How plans are looked for: ways by rehearsals, what is made of them, and the trial before one is followed."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from policy_server.planning.beam import Beam
from policy_server.planning.boat import Boat
from policy_server.planning.program import Program
from policy_server.planning.reference import Follower
from policy_server.planning.rehearsal import Rehearsal
from policy_server.planning.search import Guess, Order, Search, lengths
from policy_server.planning.trial import Trial, Tried
from policy_server.planning.workers import Planning, Solvers
from policy_server.policy import Policy
from policy_server.shipped import shipped_policy
from tests.boats import AT_REST, DT, LIMIT, PLACES, REACH, ROBOT, SHIPPED, SMALL, TASK, Idle


@pytest.fixture(scope="module")
def boat():
    return Boat(ROBOT)


@pytest.fixture(scope="module")
def rehearsal():
    return Rehearsal(ROBOT, TASK, Policy(shipped_policy(ROBOT.name, TASK.name), ROBOT, TASK))


@pytest.fixture(scope="module")
def solvers():
    return Solvers(lambda legs: Program(Boat(ROBOT), legs=legs, nodes=SMALL.nodes), 1)


def searching(boat, rehearsal, solve, settings=SMALL):
    return Search(Beam(boat, rehearsal, settings, DT), settings, solve, dt=DT)


def an_order(start=AT_REST, places=PLACES, horizon_s=60.0, reach=REACH):
    return Order(start, places, horizon_s, reach, LIMIT)


def some_orders(count, horizon_s):
    rng = np.random.default_rng(8)
    at = np.column_stack((rng.uniform(-2.0, 6.0, (count, 2)), rng.uniform(-3.0, 3.0, count)))
    return [an_order(np.append(pose, np.zeros(5)), PLACES[::-1], horizon_s) for pose in at]


@pytest.fixture(scope="module")
def course(boat, rehearsal, solvers):
    (found,) = searching(boat, rehearsal, solvers).plans([an_order()])
    return found


def test_a_plan_passes_each_waypoint_in_time_as_near_as_it_may(course):
    passed = int(course.worth)
    assert passed >= 4
    nodes = course.best.states[SMALL.nodes :: SMALL.nodes, :2][:passed]
    assert (np.hypot(*(nodes - course.places[:passed]).T) < course.most[:passed] + 1e-3).all()


def test_a_plan_does_not_depend_on_what_else_is_ordered(boat, rehearsal, solvers, course):
    other = np.array([1.0, -2.0, 2.0, 0.3, 0.0, 0.1, 0.2, 0.0])
    _, again = searching(boat, rehearsal, solvers).plans([an_order(other, PLACES[::-1], 30.0), an_order()])
    np.testing.assert_array_equal(again.best.states, course.best.states)
    np.testing.assert_array_equal(again.best.leg_s, course.best.leg_s)


@pytest.mark.slow
def test_ways_are_quicker_than_the_controllers_own(boat, rehearsal):
    rng, count = np.random.default_rng(2), 6
    courses, starts = list(rng.uniform(-3.0, 3.0, (count, 8, 2))), np.zeros((count, 8))

    def steps(width, tries):
        told = replace(SMALL, legs=12, width=width, tries=tries, ahead=3)
        found = Beam(boat, rehearsal, told, DT).ways(starts, courses, [60.0] * count, beyond=0)
        return np.array([len(ways[0].states) for ways in found])

    own, found = steps(1, 1), steps(4, 16)
    assert found.sum() < 0.998 * own.sum()


def test_ways_differ_and_the_quickest_comes_first(boat, rehearsal):
    (ways,) = Beam(boat, rehearsal, SMALL, DT).ways(AT_REST[None], [PLACES], [60.0], beyond=0)
    assert 1 < len(ways) <= SMALL.width
    for way in ways:
        assert way.done[-1] == SMALL.legs
        np.testing.assert_array_equal(way.states[0], AT_REST)
        assert len(way.states) == len(way.done)
    ends = np.array([way.states[-1] for way in ways])
    assert np.ptp(ends[:, 2]) > 0.2 or np.ptp([len(way.states) for way in ways]) > 4


def test_no_more_is_looked_for_than_a_horizon_asks_for(boat, rehearsal):
    (ways,) = Beam(boat, rehearsal, SMALL, DT).ways(AT_REST[None], [PLACES], [3.0], beyond=1)
    assert ways[0].done[-1] == 2


def test_where_the_controller_never_arrives_there_is_no_plan(boat, solvers):
    idle = Rehearsal(ROBOT, TASK, Idle())
    (found,) = searching(boat, idle, solvers).plans([an_order()])
    assert found.best is None


ENDS_WHILE_IT_SEARCHES = """
from dataclasses import replace
import numpy as np
from policy_server.planning.planner import Planner
from policy_server.planning.search import Order
from policy_server.policy import Policy
from policy_server.shipped import shipped_policy
from tests.boats import AT_REST, LIMIT, PLACES, REACH, ROBOT, SMALL, TASK

endless = replace(SMALL, legs=100_000)
planner = Planner(
    ROBOT, TASK, lambda: Policy(shipped_policy(ROBOT.name, TASK.name), ROBOT, TASK), endless, patient=False
)
plans = planner._planning.begin([Order(AT_REST, PLACES, 1e7, REACH, LIMIT)])
while not plans.running():
    pass
print("searching", flush=True)
"""


def test_a_process_that_ends_is_not_held_up_by_the_search():
    ended = subprocess.run(
        [sys.executable, "-c", ENDS_WHILE_IT_SEARCHES],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "searching\n", "")


def test_a_search_that_is_of_no_use_any_more_finds_nothing(boat, rehearsal):
    asked = []

    def wanted():
        asked.append(True)
        return len(asked) < 3

    beam = Beam(boat, rehearsal, SMALL, DT, wanted=wanted)
    assert beam.ways(AT_REST[None], [PLACES], [60.0], beyond=0) == [[]]


def test_haste_is_to_the_first_waypoint_that_would_come_too_late_and_to_none_after_it(
    boat, rehearsal, solvers
):
    orders = some_orders(4, 12.0)
    search = searching(boat, rehearsal, solvers)
    for found in search.plans(orders):
        assert found.worth >= 1.0
        guess = search._hurried(found)
        assert guess.wanted == int(found.worth) + 1
        assert len(guess.drive.leg_s[guess.kept :]) in lengths(SMALL.legs)


def test_what_is_kept_of_a_drive_stays_as_it_is(solvers, course):
    guess = replace(guess_of(course), kept=3, wanted=5)
    (found,) = solvers([guess])
    np.testing.assert_array_equal(found.states[: 3 * SMALL.nodes], course.best.states[: 3 * SMALL.nodes])
    np.testing.assert_array_equal(found.leg_s[:3], course.best.leg_s[:3])


def guess_of(course):
    legs = len(course.best.leg_s)
    return Guess(course.best, course.places[:legs], legs, course.reach[:legs], course.most[:legs])


@pytest.fixture(scope="module")
def trial(boat):
    return Trial(ROBOT, TASK, Follower(boat, SHIPPED, DT), SHIPPED, DT)


def test_what_is_followed_is_what_the_cores_own_boat_did_with_the_plan(trial, course, boat):
    (tried,) = trial.drive([course])
    reference = tried.reference
    planned = Follower(boat, SHIPPED, DT).of_drive(course.best)
    assert len(reference.states) == len(planned.states)
    off = np.hypot(*(reference.states - planned.states)[:, :2].T)
    assert 1e-4 < off.max() < 0.2
    step = boat.step(DT)
    rates = (reference.states[1:, 6:] - reference.states[:-1, 6:]) / DT
    after = np.asarray(step.map(len(rates))(reference.states[:-1].T, rates.T)).T
    np.testing.assert_allclose(after[:, :6], reference.states[1:, :6], atol=0.02)


@pytest.mark.slow
def test_a_plan_that_passes_too_far_away_is_changed_until_the_boat_passes(
    boat, rehearsal, solvers, monkeypatch
):
    """With plans that may pass a waypoint at the very limit."""
    bold = replace(SMALL, reach=1.0, most=1.0)
    search, trial = (
        searching(boat, rehearsal, solvers, bold),
        Trial(ROBOT, TASK, Follower(boat, SHIPPED, DT), bold, DT),
    )
    orders = [replace(order, reach=LIMIT) for order in some_orders(4, 15.0)]
    before = [tried.missed.sum() for tried in trial.drive(search.plans(orders))]
    assert sum(before) >= 2

    tries = []
    drive = trial.drive

    def counted(courses):
        tries.append(drive(courses))
        return tries[-1]

    monkeypatch.setattr(trial, "drive", counted)
    plans = Planning(search, trial).begin(orders).result()
    assert all(plan is not None for plan in plans)
    assert 2 <= len(tries) <= 3
    assert sum(tried.missed.sum() for tried in tries[-1]) < sum(before)


def test_what_is_missed_in_the_last_trial_is_not_changed_any_more(boat, rehearsal, solvers):
    search, changed = searching(boat, rehearsal, solvers), []
    missing = Tried(
        Follower(boat, SHIPPED, DT).of_drive(search.plans([an_order()])[0].best), np.ones(1, bool)
    )

    def nearer(failed):
        changed.append(failed)
        return [True] * len(failed)

    search.nearer = nearer
    trials = []
    always_missed = SimpleNamespace(drive=lambda courses: trials.append(courses) or [missing] * len(courses))
    (plan,) = Planning(search, always_missed).begin([an_order()]).result()
    assert plan is missing.reference
    assert len(changed) == len(trials) - 1


def test_where_there_is_no_plan_there_is_nothing_to_follow(boat, solvers, trial):
    search = searching(boat, Rehearsal(ROBOT, TASK, Idle()), solvers)
    assert Planning(search, trial).begin([an_order()]).result() == [None]
