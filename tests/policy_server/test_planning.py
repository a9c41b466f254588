"""Plans of a boat's course: the formulas, the program, the references, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from fulmar_core.controllers.classical import load_classical
from fulmar_core.errors import ConfigError
from fulmar_core.robot import load_robot
from fulmar_core.tasks import load_task
from policy_server.planning.boat import MOTION, Boat
from policy_server.planning.loading import check_planner
from policy_server.planning.program import Drive, Program
from policy_server.planning.reference import Follower, Reference
from policy_server.planning.rehearsal import Rehearsal
from tests.boats import AT_REST, DT, PLACES, REACH, ROBOT, SHIPPED, TASK, Held

LEGS, NODES = 4, 6
ROUND = np.arange(LEGS) % len(PLACES)  # numbers of a plan's waypoints


@pytest.fixture(scope="module")
def boat():
    return Boat(ROBOT)


@pytest.fixture(scope="module")
def rehearsal():
    return Rehearsal(ROBOT, TASK, load_classical(ROBOT, TASK))


@pytest.fixture(scope="module")
def program(boat):
    return Program(boat, legs=LEGS, nodes=NODES)


@pytest.fixture(scope="module")
def begun(rehearsal):
    """A drive of the classical law at nodes."""
    seen = rehearsal.drive(AT_REST[None], PLACES[None], steps=900, until=np.array([LEGS]))
    times, states, pieces, leg_s = DT * np.arange(seen.states.shape[1]), seen.states[0], [], []
    for since, until in pairwise(DT * np.searchsorted(seen.done[0], np.arange(LEGS + 1))):
        at = since + (until - since) * np.arange(NODES) / NODES
        pieces.append(np.column_stack([np.interp(at, times, column) for column in states.T]))
        leg_s.append(until - since)
    return Drive(np.vstack((*pieces, states[-1])), np.array(leg_s))


@pytest.fixture(scope="module")
def drive(program, begun):
    return solved(program, begun)


def solved(program, begun, *, places=PLACES, reach=REACH, most=REACH, wanted=LEGS):
    return program.solve(begun, places, wanted=wanted, reach=np.full(LEGS, reach), most=np.full(LEGS, most))


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
    at = drive.states[NODES::NODES, :2]
    assert np.hypot(*(at - PLACES[ROUND]).T).max() < REACH + 1e-3
    commands = drive.states[:, MOTION:]
    assert boat.least - 1e-6 <= commands.min() and commands.max() <= boat.most + 1e-6
    steps = np.diff(drive.times)[:, None] * boat.slew
    assert (np.abs(np.diff(commands, axis=0)) <= steps * (1.0 + 1e-6) + 1e-6).all()


def test_a_plan_is_quicker_than_the_drive_that_it_began_from(drive, rehearsal):
    seen = rehearsal.drive(AT_REST[None], PLACES[None], steps=900, until=np.array([LEGS]))
    assert drive.arrivals[-1] < 0.9 * DT * (seen.states.shape[1] - 1)


def test_waypoints_in_time_are_counted_with_a_share_of_the_next():
    drive = Drive(np.zeros((7, 8)), np.array([2.0, 3.0, 5.0]))
    assert [drive.passed(t) for t in (0.0, 1.0, 2.0, 3.5, 10.0, 99.0)] == [0.0, 0.5, 1.0, 1.5, 3.0, 3.0]
    np.testing.assert_allclose(drive.times, [0.0, 1.0, 2.0, 3.5, 5.0, 7.5, 10.0])


def test_a_reference_goes_through_the_plan_at_the_controllers_own_rate(boat, drive):
    reference = Follower(boat, SHIPPED, DT).of_drive(drive)
    assert len(reference.states) == int(drive.times[-1] / DT) + 1
    for number, step in enumerate(reference.arrivals[:-1]):
        near = reference.states[step - 1 : step + 2, :2] - PLACES[ROUND][number]
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


def test_a_waypoint_is_passed_farther_away_where_near_takes_too_long(program):
    """By a boat that comes too fast and too near to turn to it."""
    ends, places = (
        np.array([0.0, 0.8, 3.0, 5.0, 7.0]),
        np.array([[0.8, 0.3], [3.0, 0.0], [5.0, 0.0], [7.0, 0.0]]),
    )
    straight = np.zeros((LEGS * NODES + 1, 8))
    straight[:, 0] = np.interp(np.arange(LEGS * NODES + 1) / NODES, np.arange(LEGS + 1), ends)
    straight[:, 3], straight[:, MOTION:] = 1.0, 0.75
    begun = Drive(straight, np.diff(ends))
    assert solved(program, begun, places=places, reach=0.02, most=0.02) is None
    found = solved(program, begun, places=places, reach=0.02, most=0.5)
    off = np.hypot(*(found.states[NODES::NODES, :2] - places).T)
    assert 0.1 < off[0] < 0.5 and off[1:].max() < 0.02 + 1e-3


def test_legs_that_do_not_matter_are_driven_without_haste(program, begun):
    all_, two = (solved(program, begun, wanted=wanted).leg_s for wanted in (LEGS, 2))
    assert two[:2].sum() < all_[:2].sum() - 0.01
    assert two.sum() > all_.sum()


def test_where_nothing_leads_from_waypoint_to_waypoint_there_is_no_drive(program, begun):
    far = np.add(PLACES, [[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [200.0, 0.0]])  # farther than the longest leg
    assert solved(program, begun, places=far) is None


def test_drives_are_taken_apart_and_joined_between_legs(begun):
    first, later = begun.before(1), begun.since(1)
    assert first.nodes == later.nodes == begun.nodes
    np.testing.assert_array_equal(first.then(later).states, begun.states)
    np.testing.assert_array_equal(first.then(later).leg_s, begun.leg_s)


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
        ({"believed": 0.0}, r"'believed' must lie in \(0, 1\]"),
        ({"tries": 0}, "'tries' must be at least 1"),
        ({"held_s": (2.0, 1.0)}, "'held_s'"),
    ],
)
def test_settings_that_no_plan_can_be_made_with_are_refused(wrong, said):
    with pytest.raises(ValueError, match=said):
        replace(SHIPPED, **wrong)
