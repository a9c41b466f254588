"""Plans of a boat's course: the formulas, the program, the search, and what follows a plan."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config import load_config
from fulmar_core.controllers.classical import load_classical
from fulmar_core.errors import ConfigError
from fulmar_core.robot import load_robot
from fulmar_core.tasks import load_task
from policy_server.planning.boat import MOTION, Boat
from policy_server.planning.loading import check_planner, settings_path
from policy_server.planning.pilot import Pilot
from policy_server.planning.program import Drive, Program
from policy_server.planning.reference import Follower, Reference
from policy_server.planning.rehearsal import Rehearsal
from policy_server.planning.search import Order, Search
from policy_server.planning.settings import PlannerSettings
from policy_server.planning.whereabouts import Whereabouts, locate

ROBOT, TASK = load_robot("kingfisher"), load_task("go_through_positions")
DT, REACH = 0.1, 0.15
SHIPPED = load_config(PlannerSettings, settings_path("kingfisher"))
SMALL = replace(SHIPPED, legs=4, nodes=6, rounds=1, detours=6)
PLACES = np.array([[3.0, 1.0], [4.0, 4.0], [1.0, 5.0], [-1.0, 2.0]])
AT_REST = np.zeros(8)


class Idle:
    """A controller that stays where it is."""

    name, observation_names, control_hz = "idle", (), 10.0

    def reset(self):
        pass

    def act(self, observation):
        return np.zeros((len(observation), 2))

    def metadata(self):
        return {}


@pytest.fixture(scope="module")
def boat():
    return Boat(ROBOT)


@pytest.fixture(scope="module")
def rehearsal():
    return Rehearsal(ROBOT, TASK, load_classical(ROBOT, TASK))


@pytest.fixture(scope="module")
def search(boat, rehearsal):
    program = Program(boat, legs=SMALL.legs, nodes=SMALL.nodes)
    return searching(boat, rehearsal, program, SMALL)


def searching(boat, rehearsal, program, settings):
    def solve(guesses):
        return [
            program.solve(guess.drive, guess.course, wanted=guess.wanted, reach=guess.reach)
            for guess in guesses
        ]

    return Search(boat, rehearsal, settings, solve, dt=DT)


@pytest.fixture(scope="module")
def drive(search):
    (found,) = search.plans([Order(AT_REST, PLACES, 60.0, REACH)])
    assert found is not None
    return found


class Held:
    """A controller that gives commands that were written down."""

    name, observation_names, control_hz = "held", (), 10.0

    def __init__(self, commands):
        self._commands, self._step = commands, 0

    def reset(self):
        self._step = 0

    def act(self, observation):
        self._step += 1
        return np.repeat(self._commands[self._step - 1][None], len(observation), axis=0)


@pytest.mark.parametrize("added_mass", [(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (4.0, 20.0, 0.0, 0.0, 0.0, 2.0)])
def test_the_boat_of_the_plans_moves_as_the_boat_of_the_core(added_mass):
    robot = replace(ROBOT, hydrodynamics=replace(ROBOT.hydrodynamics, added_mass=added_mass))
    rng = np.random.default_rng(3)
    commands = rng.choice([-0.65, -0.55, -0.2, 0.0, 0.35, 0.65, 0.75], (200, 2))
    motion = rng.uniform(-1.0, 1.0, (200, 3)) * [1.2, 0.3, 0.5]
    states = np.column_stack((rng.uniform(-5.0, 5.0, (200, 3)), motion, commands))
    seen = Rehearsal(robot, TASK, Held(commands[:1])).drive(
        states, np.repeat(PLACES[None], 200, axis=0), steps=0
    )
    np.testing.assert_allclose(seen.states[:, 0], states, atol=1e-12)
    step = Boat(robot).step(DT)
    for state, command in zip(states[:40], commands[:40], strict=True):
        rehearsal = Rehearsal(robot, TASK, Held(command[None]))
        after = rehearsal.drive(state[None], PLACES[None], steps=1).states[0, 1]
        expected = np.asarray(step(state, np.zeros(2))).ravel()
        np.testing.assert_allclose(after, expected, atol=0.01)
        assert np.abs(after[:MOTION] - state[:MOTION]).max() > 0.01


def test_a_plan_is_a_drive_that_the_boat_of_the_core_makes_when_it_is_commanded_so(drive, boat):
    times = np.arange(0.0, drive.arrivals[1], DT)
    commands = np.column_stack(
        [np.interp(times + DT, drive.times, column) for column in drive.states[:, MOTION:].T]
    )
    seen = Rehearsal(ROBOT, TASK, Held(commands)).drive(AT_REST[None], PLACES[None], steps=len(times))
    assert seen.done[0, -1] >= 1
    planned = np.column_stack([np.interp(times, drive.times, column) for column in drive.states[:, :2].T])
    assert np.hypot(*(seen.states[0, : len(times), :2] - planned).T).max() < 0.15


def test_a_plan_begins_where_it_was_asked_to_passes_every_waypoint_and_asks_for_nothing_impossible(
    drive, boat
):
    np.testing.assert_allclose(drive.states[0], AT_REST, atol=1e-6)
    at = drive.states[SMALL.nodes :: SMALL.nodes, :2]
    assert np.hypot(*(at - PLACES).T).max() < REACH + 1e-3
    commands = drive.states[:, MOTION:]
    assert boat.least - 1e-6 <= commands.min() and commands.max() <= boat.most + 1e-6
    steps = np.diff(drive.times)[:, None] * boat.slew
    assert (np.abs(np.diff(commands, axis=0)) <= steps * (1.0 + 1e-6) + 1e-6).all()


def test_a_plan_is_quicker_than_the_drive_that_it_began_from(drive, rehearsal):
    seen = rehearsal.drive(AT_REST[None], PLACES[None], steps=900, until=np.array([4]))
    assert drive.arrivals[-1] < 0.9 * DT * (seen.states.shape[1] - 1)


def test_a_plan_does_not_depend_on_what_else_is_ordered(search, drive):
    other = np.array([1.0, -2.0, 2.0, 0.3, 0.0, 0.1, 0.2, 0.0])
    _, again = search.plans([Order(other, PLACES[::-1], 30.0, REACH), Order(AT_REST, PLACES, 60.0, REACH)])
    np.testing.assert_array_equal(again.states, drive.states)
    np.testing.assert_array_equal(again.leg_s, drive.leg_s)


def test_looking_for_another_way_finds_some_and_never_makes_a_plan_worse(boat, rehearsal, search):
    rng = np.random.default_rng(8)
    starts = np.column_stack((rng.uniform(-2.0, 6.0, (6, 2)), rng.uniform(-3.0, 3.0, 6), np.zeros((6, 5))))
    worth = []
    for rounds in (0, 3):
        searching_so = Search(boat, rehearsal, replace(SMALL, rounds=rounds), search._solve, dt=DT)
        found = searching_so.plans([Order(start, PLACES[::-1], 12.0, REACH) for start in starts])
        worth.append([drive.passed(12.0) for drive in found])
    assert (np.array(worth[1]) >= worth[0]).all()
    assert max(np.subtract(worth[1], worth[0])) > 0.05


def test_a_process_that_ends_is_not_held_up_by_the_search_for_other_ways(
    boat, rehearsal, search, monkeypatch
):
    tried = []

    def solve(guesses):
        tried.append(len(guesses))
        return search._solve(guesses)

    def plan():
        tried.clear()
        Search(boat, rehearsal, replace(SMALL, rounds=3), solve, dt=DT).plans(
            [Order(AT_REST, PLACES, 60.0, REACH)]
        )
        return len(tried)

    assert plan() == 4
    ended = threading.Thread()
    monkeypatch.setattr(threading, "main_thread", lambda: ended)
    assert plan() == 1


def test_where_the_controller_never_arrives_there_is_no_plan(boat, search):
    idle = Rehearsal(ROBOT, TASK, Idle())
    told = replace(SMALL, legs=2)
    assert Search(boat, idle, told, search._solve, dt=DT).plans([Order(AT_REST, PLACES, 60.0, REACH)]) == [
        None
    ]


def test_waypoints_in_time_are_counted_with_a_share_of_the_next():
    drive = Drive(np.zeros((7, 8)), np.array([2.0, 3.0, 5.0]))
    assert [drive.passed(t) for t in (0.0, 1.0, 2.0, 3.5, 10.0, 99.0)] == [0.0, 0.5, 1.0, 1.5, 3.0, 3.0]
    np.testing.assert_allclose(drive.times, [0.0, 1.0, 2.0, 3.5, 5.0, 7.5, 10.0])


def driven(reference, start, *, gains=True):
    """Distances from a reference of a boat that is brought along it from somewhere beside it."""
    boat, off, state = Boat(ROBOT), [], start.copy()
    step = boat.step(DT)
    told = reference if gains else replace(reference, gains=0.0 * reference.gains)
    pilot = pilot_on(told, state=start)
    while not pilot.at_end:
        seen = look(pilot, state, 0)
        pilot.is_lost(seen)
        off.append(np.hypot(*(reference.states[:, :2] - state[:2]).T).min())
        rates = (pilot.command(seen, DT * boat.slew) - seen[MOTION:]) / DT
        state = boat.useful(np.asarray(step(state, rates)).ravel())
    return np.array(off)


def test_a_boat_beside_its_reference_is_brought_back_to_it(boat, drive):
    reference = Follower(boat, SHIPPED, DT).of_drive(drive)
    start = drive.states[0] + [0.0, 0.15, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0]
    late = slice(70, 110)
    assert driven(reference, start)[late].max() < 0.05 < driven(reference, start, gains=False)[late].max()


def test_a_reference_goes_through_the_plan_at_the_controllers_own_rate(boat, drive):
    reference = Follower(boat, SHIPPED, DT).of_drive(drive)
    assert len(reference.states) == int(drive.times[-1] / DT) + 1
    for number, step in enumerate(reference.arrivals[:-1]):
        near = reference.states[step - 1 : step + 2, :2] - PLACES[number]
        assert np.hypot(*near.T).min() < REACH + 0.03


def test_one_reference_after_another_keeps_turns_and_arrivals():
    def straight(yaw, arrivals):
        states = np.zeros((4, 8))
        states[:, 2] = yaw
        return Reference(states, np.zeros((3, 2, 8)), np.zeros((3, 2)), np.array(arrivals))

    joined = straight(7.0, [1]).then(straight(7.0 - 2.0 * np.pi, [2, 3]))
    np.testing.assert_allclose(joined.states[:, 2], 7.0)
    np.testing.assert_array_equal(joined.arrivals, [1, 5, 6])
    assert len(joined.states) == len(joined.changes) + 1 == 7


def sight_of(where, places, seen=3):
    ahead = places[(where.coming + np.arange(seen)) % len(places)]
    return (ahead - complex(where.x, where.y)) * np.exp(-1j * where.yaw)


def test_a_boat_knows_from_three_waypoints_where_it_is_and_which_comes_next():
    rng = np.random.default_rng(5)
    places = rng.uniform(-8.0, 8.0, 9) + 1j * rng.uniform(-8.0, 8.0, 9)
    for coming in range(9):
        true = Whereabouts(*rng.uniform(-5.0, 5.0, 2), rng.uniform(-3.0, 3.0), coming)
        found = locate(sight_of(true, places), places, None)
        np.testing.assert_allclose((found.x, found.y, found.yaw), (true.x, true.y, true.yaw), atol=1e-9)
        assert found.coming == coming


def test_on_a_course_that_is_like_itself_the_step_before_decides():
    square = np.array([0.0, 4.0, 4.0 + 4.0j, 4.0j])
    before = Whereabouts(3.9, 0.1, 7.0, 1)
    for coming in (1, 2):
        true = Whereabouts(4.0, 0.15, 7.05, coming)
        found = locate(sight_of(true, square), square, before)
        np.testing.assert_allclose((found.x, found.y, found.yaw), (true.x, true.y, true.yaw), atol=1e-9)
        assert found.coming == coming


def pilot_on(reference, *, state=AT_REST, late_steps=2):
    pilot = Pilot(PLACES, SHIPPED, late_steps=late_steps)
    look(pilot, state, 0)
    pilot.follow(reference)
    return pilot


def look(pilot, state, coming):
    places = PLACES[:, 0] + 1j * PLACES[:, 1]
    where = Whereabouts(state[0], state[1], state[2], coming)
    return pilot.see(sight_of(where, places), state[3:6], state[6:])


def standing(steps, arrivals):
    return Reference(
        np.zeros((steps + 1, 8)),
        np.zeros((steps, 2, 8)),
        np.zeros((steps, 2)),
        np.asarray(arrivals, dtype=int),
    )


def test_a_waypoint_that_is_not_passed_in_time_is_missed():
    pilot = pilot_on(standing(9, [3]))
    lost = [pilot.is_lost(look(pilot, AT_REST, 0)) for _ in range(8)]
    assert lost == [False] * 6 + [True] * 2


def test_a_waypoint_that_is_passed_in_time_is_not_missed():
    pilot = pilot_on(standing(9, [3]))
    assert not any(pilot.is_lost(look(pilot, AT_REST, int(step >= 3))) for step in range(8))


def test_a_boat_far_from_its_reference_is_lost():
    pilot = pilot_on(standing(9, []))
    assert not pilot.is_lost(look(pilot, AT_REST, 0))
    assert pilot.is_lost(look(pilot, np.array([0.6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), 0))


def test_a_reference_waits_for_a_boat_that_is_behind_it():
    states = np.zeros((30, 8))
    states[:, 0], states[:, 3] = 0.1 * np.arange(30), 1.0
    pilot = pilot_on(Reference(states, np.zeros((29, 2, 8)), np.zeros((29, 2)), np.zeros(0, dtype=int)))
    for step in range(20):  # at half the speed
        state = np.array([0.05 * step, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
        assert not pilot.is_lost(look(pilot, state, 0))
    assert abs(pilot._at - 10) <= 1


@pytest.mark.parametrize(
    ("robot", "task", "said"),
    [
        (
            "turtlebot2",
            "go_through_positions",
            "boats with propellers that slew; 'turtlebot2' has differential_drive",
        ),
        ("kingfisher", "go_to_pose", "plans no 'go_to_pose'; it does: go_through_positions"),
    ],
)
def test_a_pair_without_plans_is_refused_with_what_to_use_instead(robot, task, said):
    with pytest.raises(ConfigError, match=said) as told:
        check_planner(load_robot(robot), load_task(task))
    assert "Use --controller policy" in str(told.value)


def test_a_boat_of_ones_own_is_told_which_file_it_lacks():
    with pytest.raises(ConfigError, match=r"Write configs/controllers/dinghy_planner\.yaml"):
        check_planner(replace(ROBOT, name="dinghy"), TASK)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"legs": 0}, "'legs' must be at least 1"),
        ({"lead_s": 0.0}, "'lead_s' must be greater than 0"),
        ({"reach": 1.5}, r"'reach' must lie in \(0, 1\]"),
        ({"rounds": -1}, "'rounds' must not be negative"),
        ({"detour_s": (2.0, 1.0)}, "'detour_s'"),
    ],
)
def test_settings_that_no_plan_can_be_made_with_are_refused(wrong, said):
    with pytest.raises(ValueError, match=said):
        replace(SHIPPED, **wrong)
