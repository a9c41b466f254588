"""Yardsticks: what can be held, and how soon one can be there."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episodes
from fulmar_core.tasks import load_task
from fulmar_core.worlds.holdability import can_hold, hold_margin, uncontrollable_losses
from fulmar_core.worlds.scenario import load_scenario
from fulmar_evaluation.bounds.approach import approach_bound, can_hold_episodes

PLATFORM, FLYER = load_robot("floating_platform"), load_robot("modular_freeflyer")
TASK = load_task("drift_go_to_pose")
ALL, NO_FORCE = np.ones(8), np.zeros(2)
APART = replace(PLATFORM, actuators=replace(PLATFORM.actuators, shared_pressure=False))


def drawn(scenario, count=64):
    return draw_episodes(PLATFORM, TASK, load_scenario(scenario), seed=4, numbers=np.arange(count))


def margin_by_facets(wrenches):
    """How far an octahedron about the origin fits into the hull of wrenches and of none, by its facets."""
    from scipy.spatial import ConvexHull

    hull = ConvexHull(np.vstack((wrenches, np.zeros(3))))
    normals, offsets = hull.equations[:, :3], hull.equations[:, 3]
    return np.min(-offsets / np.abs(normals).max(axis=1))


def working(lost):
    return np.array([0.0 if i in lost else 1.0 for i in range(8)])


PAIRS = list(itertools.combinations(range(8), 2))


def test_any_single_valve_may_be_lost():
    assert all(can_hold(PLATFORM, (i,), heading=0.0) for i in range(8))


def test_of_two_lost_valves_those_that_leave_a_direction_or_a_way_to_turn_are_the_ones_that_matter():
    able = {pair for pair in PAIRS if can_hold(PLATFORM, pair, heading=0.3)}
    one_way = {(0, 5), (1, 4), (2, 7), (3, 6)}  # both nozzles of one direction
    assert not able & one_way
    assert len(able) == 16
    # Without (0, 2) nothing turns clockwise but what also pushes, and what would undo that turns back.
    assert (0, 2) not in able
    assert (0, 4) in able


def test_a_robot_is_uncontrollable_without_what_it_cannot_hold_a_pose_without():
    assert set(uncontrollable_losses(PLATFORM, 2)) == {pair for pair in PAIRS if not can_hold(PLATFORM, pair)}
    assert uncontrollable_losses(PLATFORM, 1) == ()
    assert uncontrollable_losses(load_robot("turtlebot2"), 1) == ()


@pytest.mark.parametrize("lost", [(), (0,), (5,), *PAIRS[::5]], ids=str)
def test_the_margin_is_the_one_that_geometry_gives(lost):
    """All thrusts share, so mean wrenches fill the hull of single valves and of none."""
    wrench = PLATFORM.actuators.wrench_per_newton[:, [0, 1, 5]] / [1.0, 1.0, 0.31] * working(lost)[:, None]
    found = hold_margin(PLATFORM, working(lost), NO_FORCE, 0.0, 0.0)
    assert found == pytest.approx(margin_by_facets(wrench), abs=1e-6)


def test_a_push_takes_from_the_margin_until_nothing_is_left():
    margins = [
        hold_margin(PLATFORM, ALL, np.array([force, 0.0]), 0.0, np.pi / 4) for force in (0.0, 0.4, 0.8, 1.1)
    ]
    assert margins == sorted(margins, reverse=True)
    assert margins[2] > 0.0 > margins[3]


def test_a_force_is_held_in_the_nozzles_direction_that_is_too_strong_across():
    force = (0.9, 0.0)
    assert can_hold(PLATFORM, force=force, heading=np.pi / 4)
    assert not can_hold(PLATFORM, force=force, heading=0.0)
    assert can_hold(PLATFORM, force=force)
    assert not can_hold(PLATFORM, force=(1.1, 0.0))


def test_a_torque_is_held_up_to_what_all_thrust_at_the_rim_makes():
    assert can_hold(PLATFORM, torque=0.3, heading=0.0)
    assert not can_hold(PLATFORM, torque=0.32)


def test_valves_with_a_pressure_line_each_hold_more():
    assert can_hold(APART, force=(1.5, 0.0), heading=0.0)
    assert not can_hold(PLATFORM, force=(1.5, 0.0))


@pytest.mark.parametrize(
    ("scenario", "share"),
    [("drift_ideal", 1.0), ("drift_force_4", 1.0), ("drift_force_torque", 1.0), ("drift_one_lost", 1.0)],
)
def test_every_condition_of_the_benchmark_but_two_lost_valves_can_be_held(scenario, share):
    assert np.mean(can_hold_episodes(PLATFORM, drawn(scenario))) == share


def test_episodes_are_evaluated_by_their_own_lost_valves():
    episodes = drawn("drift_two_lost")
    able = can_hold_episodes(PLATFORM, episodes)
    lost = [tuple(np.flatnonzero(column == 0.0)) for column in episodes.world.alive.T]
    assert [can_hold(PLATFORM, each, heading=0.0) for each in lost] == able.tolist()
    assert 0.4 < able.mean() < 0.75


def stays_of_a_plan(distance, force, *, radius, dt=0.002, duration_s=50.0):
    """Share of time inside, of a point that brakes as late as it may to stop at the far end of the disc [%]."""
    faster, slower = (1.0 + force) / PLATFORM.body.mass, (1.0 - force) / PLATFORM.body.mass
    x, v, time_s, inside = -distance, 0.0, 0.0, 0.0
    while v >= 0.0:
        brakes = v * v >= 2.0 * slower * (radius - x - v * dt)
        v += dt * (-slower if brakes else faster)
        x, time_s = x + dt * v, time_s + dt
        inside += dt * (abs(x) < radius)
    assert x == pytest.approx(radius, abs=0.01)
    return 100.0 * (inside + duration_s - time_s) / duration_s


@pytest.mark.parametrize("force", [0.0, 0.4, -0.4])
@pytest.mark.parametrize("radius", [0.05, 0.01])
def test_a_plan_along_the_line_comes_up_to_the_bound_and_not_beyond(force, radius):
    episode = drawn("drift_ideal", 5)
    dx, dy = -episode.start.x, -episode.start.y
    distance = np.hypot(dx, dy)
    world = replace(episode.world, force_x=force * dx / distance, force_y=force * dy / distance)
    bound = approach_bound(PLATFORM, replace(episode, world=world), radius=radius, steps=250, control_dt=0.2)
    for each, limit in zip(distance, bound, strict=True):
        reached = stays_of_a_plan(each, force, radius=radius)
        assert reached <= limit + 0.4  # one control step
        assert reached > limit - 0.8


def test_a_bound_falls_with_distance_and_smaller_discs_and_rises_with_time():
    episodes = drawn("drift_ideal")
    given = {"steps": 250, "control_dt": 0.2}
    five, one = (approach_bound(PLATFORM, episodes, radius=r, **given) for r in (0.05, 0.01))
    assert np.all(one <= five)
    distance = np.hypot(episodes.start.x, episodes.start.y)
    assert np.all(np.diff(five[np.argsort(distance)]) <= 0.0)
    assert np.all(approach_bound(PLATFORM, episodes, radius=0.05, steps=500, control_dt=0.2) > five)
    assert 84.0 < five.mean() < 86.0


def test_a_force_from_outside_costs_more_than_it_gives():
    calm, pushed = (
        approach_bound(PLATFORM, drawn(name), radius=0.05, steps=250, control_dt=0.2)
        for name in ("drift_ideal", "drift_force_4")
    )
    assert pushed.mean() < calm.mean()


def test_without_a_valve_that_works_nothing_ever_arrives():
    episodes = drawn("drift_ideal", 3)
    world = replace(episodes.world, alive=np.zeros((8, 3)))
    assert not approach_bound(
        PLATFORM, replace(episodes, world=world), radius=0.05, steps=250, control_dt=0.2
    ).any()


def test_machines_without_thrusters_are_refused():
    boat = load_robot("kingfisher")
    with pytest.raises(ConfigError, match="kingfisher"):
        can_hold(boat)
    with pytest.raises(ConfigError, match="kingfisher"):
        approach_bound(boat, drawn("drift_ideal", 1), radius=0.05, steps=250, control_dt=0.2)
