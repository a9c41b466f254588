"""Bound on visits of robots that go where they point: exact where paper can state, and never beaten."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from fulmar_core.config.seeds import EVALUATION_SEED
from fulmar_core.robots.actuators.response import Response
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episodes
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import at_rest
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from fulmar_evaluation.bounds import (
    Motions,
    bound_of,
    goals_reached,
    motions_of,
    shortest_lengths,
    top_speed_bound,
    turn_limited_bound,
)
from fulmar_evaluation.bounds.leg_table import leg_table
from fulmar_evaluation.bounds.legs import best_words
from fulmar_evaluation.bounds.surge import Surge, time_lost
from fulmar_evaluation.bounds.turn_plans import TurnTour, coarse_plans, refined

RADIUS = 0.2
CAR = Motions(1.0, 0.5, ((1.0, 0.8), (-0.5, 0.8), (0.0, 0.8)))


@pytest.fixture(autouse=True, scope="module")
def coarse_tables():
    """Tables of a quarter of the size, which tours as short as these do with."""
    with pytest.MonkeyPatch.context() as patch:
        leg_table.cache_clear()
        patch.setattr("fulmar_evaluation.bounds.leg_table._CELLS", 28)
        patch.setattr("fulmar_evaluation.bounds.leg_table._CELL", 0.2)
        yield
        leg_table.cache_clear()


def tours(episodes: int, waypoints: int = 6, seed: int = 0) -> np.ndarray:
    """Waypoints in a square of 6 m, 1 m apart at least, shape (episodes, waypoints, 2)."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(-3.0, 3.0, (episodes, 1, 2))
    while places.shape[1] < waypoints:
        new = rng.uniform(-3.0, 3.0, (episodes, 2))
        near = np.linalg.norm(new - places[:, -1], axis=-1) < 1.0
        new[near] = -places[near, -1] + 0.8 * np.sign(-places[near, -1])
        places = np.concatenate((places, new[:, None]), axis=1)
    return places


def bound(waypoints, duration_s, motions=CAR, start=(0.0, 0.0), **more):
    return turn_limited_bound(
        np.array(start), waypoints, motions=motions, radius=RADIUS, duration_s=duration_s, **more
    )


def assert_last_goal_takes(seconds: float, waypoints, **more) -> None:
    """The last waypoint is in time at `seconds`, and late at 5 % less."""
    count = len(waypoints)
    assert bound(waypoints, seconds * 1.001, loop=False, **more).goals == count
    assert bound(waypoints, seconds * 0.95, loop=False, **more).goals == count - 1


@pytest.mark.parametrize("distance", [1.0, 4.0])
def test_a_straight_way_takes_its_length_at_top_speed(distance):
    assert_last_goal_takes(distance - RADIUS, np.array([[distance, 0.0]]), start_yaw=np.array(0.0))


def test_a_robot_goes_astern_where_that_is_faster_than_turning():
    slow = Motions(1.0, 0.5, ((0.0, 0.2),))
    assert_last_goal_takes(1.8 / 0.5, np.array([[-2.0, 0.0]]), start_yaw=np.array(0.0), motions=slow)


def test_wheels_go_to_and_fro_with_the_time_that_their_slew_needs_to_start_and_to_stop():
    top, slew = 0.45, 0.9
    there = (2.0 - RADIUS) / top + top / slew  # half of the last term is lost at each end
    back = (4.0 - 2.0 * RADIUS) / top + 0.5 * top / slew
    waypoints = np.array([[2.0, 0.0], [-2.0, 0.0]])
    wheels = motions_of(load_robot("turtlebot2"))
    assert_last_goal_takes(there + back, waypoints, start_yaw=np.array(0.0), motions=wheels)


def test_turning_on_the_spot_takes_its_angle_over_the_turn_rate():
    crawler = Motions(1.0, 0.0, ((0.0, 0.5),))
    angle = 2.0 - math.asin(RADIUS / 4.0)
    seconds = angle / 0.5 + math.sqrt(4.0**2 - RADIUS**2)  # to where the disc is touched first, by a tangent
    place = np.array([[4.0 * math.cos(2.0), 4.0 * math.sin(2.0)]])
    direct = 2.0 / 0.5 + 4.0 - RADIUS
    best = min(
        abs(2.0 - math.asin(RADIUS * math.sin(a) / 4.0)) / 0.5
        + 4.0 * math.cos(math.asin(RADIUS * math.sin(a) / 4.0))
        - RADIUS * math.cos(a)
        for a in np.linspace(0.0, 0.5 * math.pi, 200)
    )
    assert best <= min(seconds, direct) + 1e-9
    assert_last_goal_takes(best, place, start_yaw=np.array(0.0), motions=crawler)


def test_a_half_turn_of_a_car_takes_half_its_circle():
    forward = Motions(1.0, 0.0, ((1.0, 0.8),))
    times, _ = best_words(forward, np.array([0.0]), np.array([2.5]), np.array([math.pi]))
    assert times[0, 0] == pytest.approx(math.pi / 0.8)


def test_free_turning_is_travel_at_top_speed():
    waypoints = tours(12, seed=1)
    free = Motions(1.0, 1.0, ((0.0, 1e4),))
    fastest = top_speed_bound(np.zeros(2), waypoints, radius=RADIUS, top_speed=1.0, duration_s=30.0)
    np.testing.assert_allclose(bound(waypoints, 30.0, free).progress, fastest.progress, atol=1e-9)
    tour = TurnTour(np.zeros((12, 2)), None, waypoints, RADIUS)
    plan = coarse_plans(tour, leg_table(free, 0), np.inf).plan_to(np.arange(12), np.full(12, 6))
    _, times = refined(tour, free, plan, np.full(12, 6))
    lengths = shortest_lengths(np.zeros((2, 12)), waypoints.transpose(1, 2, 0), radius=RADIUS)
    np.testing.assert_allclose(times[:, -1], lengths[-1], rtol=2e-3)  # what grids cost


@pytest.mark.parametrize(
    "more",
    [
        Motions(1.3, 0.5, ((1.3, 0.8), (1.0, 0.8), (-0.5, 0.8), (0.0, 0.8))),
        Motions(1.0, 0.8, ((1.0, 0.8), (-0.8, 0.8), (-0.5, 0.8), (0.0, 0.8))),
        Motions(1.0, 0.5, ((1.0, 1.2), (-0.5, 1.2), (0.0, 1.2), (1.0, 0.8), (-0.5, 0.8))),
    ],
)
def test_who_can_do_more_reaches_no_less(more):
    waypoints = tours(8, seed=2)
    assert np.all(bound(waypoints, 30.0, more).progress >= 0.98 * bound(waypoints, 30.0).progress - 0.05)


def test_more_time_and_a_free_heading_reach_no_less():
    waypoints, yaw = tours(6, seed=3), np.linspace(-3.0, 3.0, 6)
    fixed = bound(waypoints, 30.0, start_yaw=yaw)
    assert np.all(bound(waypoints, 35.0, start_yaw=yaw).goals >= fixed.goals)
    free = bound(waypoints, 30.0)
    assert np.all(free.progress >= 0.98 * fixed.progress - 0.05)  # by which the coarse grid may choose worse


def steered(robot: str, waypoints, *, gain: float, slow: float) -> np.ndarray:
    """Where a robot goes that steers for the next waypoint with all its dynamics, shape (E, steps, 2)."""
    episodes, boat = len(waypoints), robot == "kingfisher"
    task = load_task("go_through_positions")
    sim = BatchSimulation(load_robot(robot), task, load_scenario("ideal"), worlds=episodes, seed=1)
    sim.truth = at_rest(*np.zeros((3, episodes), dtype=np.float32))
    rows, done, seen = np.arange(episodes), np.zeros(episodes, dtype=int), []
    for _ in range(600):
        place = np.stack((sim.truth.x, sim.truth.y), axis=-1)
        seen.append(place)
        done += np.linalg.norm(waypoints[rows, done % waypoints.shape[1]] - place, axis=1) < RADIUS
        to = waypoints[rows, done % waypoints.shape[1]] - place
        error = np.angle(np.exp(1j * (np.arctan2(to[:, 1], to[:, 0]) - sim.truth.yaw)))
        turn = np.clip(gain * error - (sim.truth.yaw_rate if boat else 0.0), -1.0, 1.0)
        ahead = np.exp(-np.square(error / slow))
        command = (ahead - turn, ahead + turn) if boat else (0.45 * ahead, 0.9 * turn)
        sim.step(np.stack(command, axis=-1))
    return np.stack(seen, axis=1)


@pytest.mark.parametrize(("robot", "least"), [("turtlebot2", 0.65), ("kingfisher", 0.15)])
@pytest.mark.slow
def test_no_steering_beats_the_bound(robot, least):
    waypoints = tours(4, seed=4)
    most = bound(waypoints, 60.0, motions_of(load_robot(robot)), start_yaw=np.zeros(4)).goals
    tracks = [steered(robot, waypoints, gain=2.0, slow=slow) for slow in (0.5, 1.0)]
    best = np.max([goals_reached(track, waypoints, radius=RADIUS) for track in tracks], axis=0)
    assert np.all(best <= most)
    assert np.mean(best / most) > least  # the bound is no sky; boats need a better law than this one


@pytest.mark.parametrize(
    ("robot", "least", "passed"),
    [("turtlebot2", 0.9, 42), pytest.param("kingfisher", 0.8, 47, marks=pytest.mark.slow)],
)
def test_planned_drives_come_near_the_bound_and_do_not_beat_it(robot, least, passed):
    """Commands of the first evaluated episodes, in thousandths, as optimal control with all the dynamics found them."""
    with np.load(Path(__file__).with_name("time_optimal_drives.npz")) as drives:
        commands = drives[robot].astype(np.float32) / 1000.0
    machine, task, scenario = load_robot(robot), load_task("go_through_positions"), load_scenario("nominal")
    numbers = np.arange(len(commands))
    sim = BatchSimulation(machine, task, scenario, worlds=len(numbers), seed=EVALUATION_SEED)
    track = []
    for command in commands.swapaxes(0, 1):
        sim.step(command)
        track.append(np.stack((sim.truth.x, sim.truth.y), axis=-1))
    drawn = draw_episodes(machine, task, scenario, seed=EVALUATION_SEED, numbers=numbers)
    places = drawn.goal.targets[..., :2]
    goals = goals_reached(np.stack(track, axis=1), places, radius=RADIUS)
    start = np.stack((drawn.start.x, drawn.start.y), axis=-1)
    most = bound_of(machine, start, places, RADIUS, task.episode_s, start_yaw=drawn.start.yaw).bound.goals
    assert np.all(goals <= most)
    assert np.mean(goals / most) >= least
    assert goals.sum() == passed


SURGE = Surge(mass=35.0, drag=17.0, ahead=39.0, astern=8.0)


def test_starting_and_stopping_take_what_their_equation_says():
    for force, sign, time, length in (
        (39.0, 1.0, SURGE.starting, SURGE.starting_length),
        (8.0, -1.0, SURGE.stopping, SURGE.stopping_length),
    ):
        seconds = quad(lambda u, f=force, s=sign: 35.0 / (f - s * 17.0 * u * u), 0.0, 1.2)[0]
        metres = quad(lambda u, f=force, s=sign: 35.0 * u / (f - s * 17.0 * u * u), 0.0, 1.2)[0]
        assert length(np.array(1.2), np.array(force)) == pytest.approx(metres)
        assert time(np.array(metres), np.array(force)) == pytest.approx(seconds)


def test_a_way_from_rest_to_rest_loses_what_starting_and_stopping_at_one_speed_do():
    half = SURGE.turning_point(np.array(3.0), np.array(39.0), np.array(8.0))
    least = SURGE.starting(half, np.array(39.0)) + SURGE.stopping(3.0 - half, np.array(8.0))
    for other in (0.98 * half, 1.02 * half):
        slower = SURGE.starting(other, np.array(39.0)) + SURGE.stopping(3.0 - other, np.array(8.0))
        assert slower < least  # its speeds would not meet, so that it is no way at all
    lost = time_lost(
        SURGE,
        np.array([[1.0], [1.5], [0.5]]),
        np.full((3, 1), 1.5),
        np.array([[True], [False], [False], [True]]),
        np.ones((3, 1)),
    )
    assert lost[0] == pytest.approx(float(least) - 2.0)


def test_who_stops_later_loses_no_less():
    def lost(stops):
        pieces = np.array([[1.0], [0.7], [2.0]])
        return time_lost(SURGE, pieces, np.full((3, 1), 1.2), np.array(stops)[:, None], np.ones((3, 1)))[0]

    assert lost([False] * 4) == 0.0
    assert 0.0 < lost([True, False, False, False]) <= lost([True, False, False, True])
    assert lost([False, False, False, True]) > lost([True, False, False, False])  # astern it has less thrust
    assert lost([True, True, False, True]) > lost([True, False, False, True])


def test_an_episode_alone_has_the_bound_that_it_has_in_a_batch():
    waypoints, yaw = tours(3, seed=5), np.array([0.3, -1.0, 2.0])
    together = bound(waypoints, 25.0, start_yaw=yaw)
    alone = [bound(waypoints[i], 25.0, start_yaw=yaw[i]) for i in range(3)]
    np.testing.assert_allclose(together.progress, [one.progress for one in alone], atol=1e-6)


@pytest.mark.parametrize(("robot", "acceleration"), [("turtlebot2", 0.9), ("leatherback", 4.0)])
def test_wheels_speed_up_and_stop_evenly(robot, acceleration):
    surge = motions_of(load_robot(robot)).surge
    way, force = np.array(0.1), surge.force(1.0)
    for time in (surge.starting, surge.stopping):
        assert time(way, force) == pytest.approx(math.sqrt(2.0 * 0.1 / acceleration), rel=1e-5)
    for length in (surge.starting_length, surge.stopping_length):
        assert length(np.array(0.4), force) == pytest.approx(0.4**2 / (2.0 * acceleration), rel=1e-5)
    assert surge.turning_point(way, force, surge.force(-1.0)) == pytest.approx(0.05, rel=1e-5)


def test_motors_hold_wheels_that_are_asked_for_more():
    robot = load_robot("turtlebot2")
    strong = replace(robot, actuators=replace(robot.actuators, response=Response(slew=(90.0, 1.8))))
    assert motions_of(strong).surge.ahead == pytest.approx(24.0 / 6.5)


def test_a_boat_holds_what_drag_and_propellers_balance():
    motions = motions_of(load_robot("kingfisher"))
    assert motions.ahead == pytest.approx(math.sqrt(39.0 / 17.257603))
    assert motions.astern == pytest.approx(math.sqrt(8.0 / 17.257603))
    speed, rate = max(motions.turns, key=lambda turn: turn[1])
    assert (5.83 + 17.33600724 * rate) * rate == pytest.approx(23.5 * 0.37765)
    assert speed == pytest.approx(math.sqrt(15.5 / 17.257603))


@pytest.mark.slow
def test_each_family_has_its_bound():
    waypoints = tours(1, seed=6)[0]
    names = {
        robot: bound_of(load_robot(robot), np.zeros(2), waypoints, RADIUS, 20.0).name
        for robot in ("floating_platform", "kingfisher", "turtlebot2")
    }
    assert names == {
        "floating_platform": "time_optimal",
        "kingfisher": "turn_limited",
        "turtlebot2": "turn_limited",
    }


@pytest.mark.parametrize("wrong", [(0.0, 0.5, ((0.0, 1.0),)), (1.0, -0.1, ((0.0, 1.0),)), (1.0, 0.5, ())])
def test_what_cannot_move_or_turn_is_refused(wrong):
    with pytest.raises(ValueError, match="'ahead' must be greater than 0"):
        Motions(*wrong)
