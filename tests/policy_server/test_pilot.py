"""One boat that follows a reference: where it is, how far it has come, and when it is lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.controllers.classical import load_classical
from policy_server.planning.boat import MOTION, Boat
from policy_server.planning.estimator import Estimator
from policy_server.planning.pilot import Pilot
from policy_server.planning.reference import Follower, Reference
from policy_server.planning.rehearsal import Rehearsal
from policy_server.planning.whereabouts import Whereabouts, locate
from tests.boats import AT_REST, DT, LIMIT, PLACES, ROBOT, SHIPPED, TASK

NEAR = SHIPPED.believed * LIMIT


@pytest.fixture(scope="module")
def rehearsal():
    return Rehearsal(ROBOT, TASK, load_classical(ROBOT, TASK))


@pytest.fixture(scope="module")
def driven_before(rehearsal):
    """States of the nominal boat that the classical law drives, shape (steps, size)."""
    seen = rehearsal.drive(AT_REST[None], PLACES[None], steps=200)
    return Boat(ROBOT).useful(seen.states[0])


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


def test_on_a_course_that_passes_the_same_places_again_the_round_is_not_mistaken():
    once = np.array([0.0, 4.0, 2.0 + 3.0j])
    again = np.tile(once, 3)
    for coming in range(9):
        true = Whereabouts(1.0, 1.2, 0.4, coming)
        found = locate(sight_of(true, again), again, Whereabouts(1.0, 1.15, 0.4, coming))
        assert found.coming == coming
        after_one_more = locate(sight_of(true, again), again, Whereabouts(1.0, 1.15, 0.4, (coming - 1) % 9))
        assert after_one_more.coming == coming


def pilot_on(reference, *, state=AT_REST, late_steps=2):
    pilot = Pilot(PLACES, SHIPPED, limit=LIMIT, late_steps=late_steps)
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
    assert lost == [False] * 5 + [True] * 3


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


def test_a_boat_does_first_what_its_reference_does_first():
    changes = np.zeros((9, 2))
    changes[0], changes[-1] = [1.0, -1.0], [-1.0, 1.0]
    pilot = pilot_on(replace(standing(9, []), changes=changes))
    np.testing.assert_allclose(pilot.command(AT_REST, np.array([0.1, 0.1])), [0.1, -0.1])


def beside_the_first_waypoint(off):
    return np.array([PLACES[0, 0] - off, PLACES[0, 1], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize(("off", "coming"), [(NEAR - 0.002, 1), (NEAR + 0.002, 0)])
def test_a_waypoint_is_passed_where_the_boat_believes_so_though_no_reading_has_told(off, coming):
    state = beside_the_first_waypoint(off)
    still = replace(standing(9, [2]), states=np.repeat(state[None], 10, axis=0))
    pilot = pilot_on(still, state=state)
    for _ in range(4):
        pilot.is_lost(look(pilot, state, 0))
    assert pilot.coming == coming


def test_a_waypoint_is_passed_too_where_others_know_that_it_was():
    pilot = pilot_on(standing(9, [3, 5]))
    look(pilot, AT_REST, 1)
    assert pilot.coming == 1
    look(pilot, AT_REST, 0)  # who knows less tells nothing
    assert pilot.coming == 1


def test_a_waypoint_that_others_know_is_passed_also_where_the_reference_goes_to_none():
    pilot = pilot_on(standing(9, []))
    look(pilot, AT_REST, 1)
    assert pilot.coming == 1


def readings_of(states, rng, std=0.02):
    return states + std * rng.normal(size=states.shape) * (np.arange(states.shape[-1]) < MOTION)


def estimator(rows=1, trust=0.1):
    return Estimator(ROBOT, TASK, rows=rows, control_hz=1.0 / DT, trust=trust, carried=SHIPPED.carried)


def test_what_is_believed_is_nearer_to_the_truth_than_what_is_read(driven_before):
    believed, rng = estimator(), np.random.default_rng(4)
    read = readings_of(driven_before, rng)
    said = np.array([believed.see(reading[None])[0] for reading in read])
    off, noise = (np.hypot(*(each - driven_before)[50:, :2].T) for each in (said, read))
    assert np.sqrt(np.mean(off**2)) < 0.5 * np.sqrt(np.mean(noise**2))


def test_first_readings_count_alike(driven_before):
    boats, rng = 400, np.random.default_rng(4)
    believed = estimator(rows=boats)
    for state in driven_before[:5]:
        said = believed.see(readings_of(np.repeat(state[None], boats, axis=0), rng))
    spread = np.std(said[:, 0] - state[0])
    assert spread == pytest.approx(0.02 / np.sqrt(5.0), rel=0.15)


def test_a_boat_that_is_carried_off_is_believed_to_be_where_it_is_read(driven_before):
    believed = estimator(rows=2)
    for state in driven_before[:20]:
        believed.see(np.stack((state, state)))
    carried = driven_before[20] + [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    said = believed.see(np.stack((carried, driven_before[20])))
    np.testing.assert_allclose(said[0], carried, atol=1e-6)
    np.testing.assert_allclose(said[1], driven_before[20], atol=1e-6)


def test_a_boat_that_was_not_seen_for_a_moment_is_believed_to_be_where_it_is_read(driven_before):
    believed, fast = estimator(), int(np.argmax(driven_before[:, 3]))
    for state in driven_before[:fast]:
        believed.see(state[None])
    after_two_missed_beats = driven_before[fast + 2]
    said = believed.see(after_two_missed_beats[None])[0]
    np.testing.assert_allclose(said[:2], after_two_missed_beats[:2], atol=0.01)


def driven(reference, start, *, gains=True):
    """Distances from a reference of a boat that is brought along it from somewhere beside it."""
    boat, off, state = Boat(ROBOT), [], start.copy()
    step = boat.step(DT)
    told = reference if gains else replace(reference, gains=0.0 * reference.gains)
    pilot = pilot_on(told, state=start)
    while not pilot.at_end and len(off) < len(reference.changes):
        seen = look(pilot, state, 0)
        pilot.is_lost(seen)
        off.append(np.hypot(*(reference.states[:, :2] - state[:2]).T).min())
        rates = (pilot.command(seen, DT * boat.slew) - seen[MOTION:]) / DT
        state = boat.useful(np.asarray(step(state, rates)).ravel())
    return np.array(off)


def test_a_boat_beside_its_reference_is_brought_back_to_it(driven_before):
    reference = Follower(Boat(ROBOT), SHIPPED, DT).of_samples(driven_before, np.zeros(0, dtype=int))
    start = driven_before[0] + [0.0, 0.15, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0]
    late = slice(70, 110)
    assert driven(reference, start)[late].max() < 0.05 < driven(reference, start, gains=False)[late].max()
