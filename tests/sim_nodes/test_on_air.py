"""A simulated platform stands where it is without air, and while a hand holds it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.controllers.classical import load_classical
from fulmar_core.estimators.actuator_health.applied import AppliedHistory
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.backend import AirBearing
from fulmar_core.simulation.episode import Episode, draw_episode
from fulmar_core.states.planar import PlanarState, at_rest
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_at
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.mock_backend import MockBackend
from sim_nodes.mujoco_backend import MujocoBackend
from sim_nodes.on_air import OnAir

ROBOT, TASK, NOMINAL = load_robot("floating_platform"), load_task("go_to_pose"), load_scenario("nominal")
OPEN = np.eye(8)[0]
TICKS_A_SECOND = 50
BUILDERS = {"mock": MockBackend, "mujoco": MujocoBackend}


@pytest.fixture(params=sorted(BUILDERS))
def build(request):
    def make(**scenario):
        backend = OnAir(BUILDERS[request.param](ROBOT), replace(NOMINAL, **scenario))
        return backend, backend.reset(episode((1.0, -2.0, 0.5)), seed=3)

    return make


def episode(start):
    drawn = draw_episode(ROBOT, TASK, NOMINAL, seed=0, number=0).world
    return Episode(at_rest(*(np.asarray(value) for value in start)), goal_at((0.0, 0.0, 0.0)), drawn)


def place(sample):
    truth = PlanarState.from_rigid(sample.truth)
    return np.array([truth.x, truth.y, truth.yaw], dtype=float)


def test_it_is_on_from_the_start_unless_the_scenario_says_late(build):
    assert build()[0].bearing_on
    late, _ = build(bearing_late_s=(1.0, 1.0))
    assert isinstance(late, AirBearing)
    assert not late.bearing_on


def test_without_air_it_stays_where_it_is_and_its_valves_stay_closed(build):
    backend, first = build(bearing_late_s=(1.0, 1.0))
    for _ in range(TICKS_A_SECOND):
        assert not backend.bearing_on
        sample = backend.step(OPEN)
        assert not sample.applied.any()
    np.testing.assert_array_equal(place(sample), place(first))
    np.testing.assert_array_equal(sample.truth.velocity_in_world, 0.0)
    assert backend.bearing_on
    for _ in range(TICKS_A_SECOND):
        sample = backend.step(OPEN)
    np.testing.assert_array_equal(sample.applied, OPEN)
    assert np.hypot(*(place(sample) - place(first))[:2]) > 0.05


def test_switched_off_on_the_way_it_stops_and_it_carries_again_after_the_same_time(build):
    backend, _ = build(bearing_late_s=(0.2, 0.2))
    for _ in range(TICKS_A_SECOND):
        backend.step(OPEN)
    assert backend.set_bearing(False) == ""
    stopped = place(backend.step(OPEN))
    for _ in range(5):
        sample = backend.step(OPEN)
    np.testing.assert_array_equal(place(sample), stopped)
    backend.set_bearing(True)
    assert not backend.bearing_on
    backend.step(OPEN, ticks=10)
    assert backend.bearing_on


def test_a_hand_holds_it_with_open_valves(build):
    backend, first = build(held_s=(0.0, 1.0))
    for _ in range(TICKS_A_SECOND):
        sample = backend.step(OPEN)
    np.testing.assert_array_equal(sample.applied, OPEN)
    np.testing.assert_array_equal(place(sample), place(first))
    for _ in range(TICKS_A_SECOND):
        sample = backend.step(OPEN)
    assert np.hypot(*(place(sample) - place(first))[:2]) > 0.05


def test_a_standing_platform_is_measured_with_noise_and_its_inertial_unit_shows_rest():
    backend = OnAir(MujocoBackend(ROBOT), replace(NOMINAL, bearing_late_s=(9.0, 9.0)))
    backend.reset(episode((0.0, 0.0, 0.0)), seed=1)
    samples = [backend.step(OPEN) for _ in range(100)]
    assert len({float(sample.odometry.position_in_world[0]) for sample in samples}) == 100
    ahead = np.array([sample.imu.specific_force[:2] for sample in samples])
    assert np.all(np.abs(ahead) < 0.05)  # 1 N would be 0.19 m/s²


def drive(lqr, backend, sample, seconds):
    """The LQR at 5 Hz on one tick of latency; the distance from the goal at the end [m], and what it then believes."""
    tick_ns, ticks = 1_000_000_000 // TICKS_A_SECOND, TICKS_A_SECOND // 5
    applied = AppliedHistory(hold_ns=2 * tick_ns)
    loop = ControlLoop(ROBOT, TASK, lqr, applied=applied)
    loop.begin(goal_at((0.0, 0.0, 0.0))[None])
    loop.reset()
    command = np.zeros(8)
    for tick in range(round(TICKS_A_SECOND * seconds)):
        before = command
        if tick % ticks == 0:
            command = loop.step(PlanarState.from_rigid(sample.measured)[None], {}, tick * tick_ns).command[0]
        sample = backend.step(before)
        applied.add(tick * tick_ns, sample.applied)
    return float(np.hypot(*place(sample)[:2])), loop.estimate.health


@pytest.mark.parametrize("seed", range(2))
def test_held_for_2_s_by_hand_the_lqr_accuses_no_valve_and_reaches_its_goal(seed):
    backend = OnAir(MujocoBackend(ROBOT), replace(NOMINAL, held_s=(1.0, 3.0)))
    start = np.random.default_rng(seed).uniform((-1.0, -1.0, -3.0), (1.0, 1.0, 3.0))
    sample = backend.reset(episode(start), seed=seed)
    lqr = load_classical(ROBOT, TASK, control_hz=5.0, law="lqr")
    distance, believed = drive(lqr, backend, sample, 14.0)
    assert distance < 0.05
    assert believed.effectiveness.min() > 0.9
    assert not believed.held.any()


def test_without_the_test_for_a_hold_valves_are_accused_that_work():
    lqr = load_classical(ROBOT, TASK, control_hz=5.0, law="lqr")
    gains = replace(lqr.gains, observer=replace(lqr.gains.observer, held=0.0, retry_s=0.0))
    lqr = type(lqr)(ROBOT, TASK, gains, control_hz=5.0)
    accused = []
    for seed in range(2):
        backend = OnAir(MujocoBackend(ROBOT), replace(NOMINAL, held_s=(1.0, 3.0)))
        start = np.random.default_rng(seed).uniform((-1.0, -1.0, -3.0), (1.0, 1.0, 3.0))
        _, believed = drive(lqr, backend, backend.reset(episode(start), seed=seed), 8.0)
        accused.append(believed.effectiveness.min() < 0.5)
    assert any(accused)


def test_while_it_is_held_the_observer_says_so():
    backend = OnAir(MujocoBackend(ROBOT), replace(NOMINAL, held_s=(1.0, 30.0)))
    lqr = load_classical(ROBOT, TASK, control_hz=5.0, law="lqr")
    _, believed = drive(lqr, backend, backend.reset(episode((1.0, 0.5, 2.0)), seed=2), 10.0)
    assert believed.held.all()
