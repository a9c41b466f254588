"""What each disturbance of a scenario does to a batch of worlds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.robots.sensors.odometer import Channel
from fulmar_core.simulation.simulation import ACTUATOR_NOISE
from fulmar_core.states.counter_rng import START
from fulmar_core.states.planar import PlanarState
from fulmar_core.worlds.parts import Actuation, Kick, Push, Sensing, Wave
from fulmar_core.worlds.scenario import load_scenario
from tests.simulations import BASE, PLATFORM, ROBOTS, STILL, build, differing, run

ACTS = {
    "push": {"push": Push(0.3, 0.3, least=0.5)},
    "wave": {"wave": Wave(0.5, 0.5)},
    "noise of the actuators": {"actuation": Actuation(noise=0.3)},
    "gain of the actuators": {"actuation": Actuation(gain=(0.5, 0.6))},
    "failures": {"actuation": Actuation(failures=1, failure_chance=1.0)},
    "uncertain body": {"body": "uncertain"},
}


@pytest.mark.parametrize("act", ACTS)
@pytest.mark.parametrize("robot", [PLATFORM, ROBOTS["kingfisher"]], ids=lambda robot: robot.name)
def test_what_disturbs_the_motion_moves_the_truth_and_leaves_the_sensors_perfect(robot, act):
    calm, moved = run(build(STILL, robot), 10), run(build(replace(STILL, **ACTS[act]), robot), 10)
    assert differing(calm.truth, moved.truth) == set(PlanarState.COLUMNS)
    assert not differing(moved.truth, moved.measured)


@pytest.mark.parametrize(
    "sensing",
    [Sensing(noise=2.0), Sensing(delay_s=0.3), Sensing(dropout=1.0)],
    ids=["noise", "delay", "dropout"],
)
def test_what_disturbs_the_sensors_leaves_the_truth_alone(sensing):
    scenario = replace(STILL, sensor_noise=True)
    calm, moved = run(build(scenario), 10), run(build(replace(scenario, sensing=sensing)), 10)
    assert not differing(calm.truth, moved.truth)
    assert differing(calm.measured, moved.measured) == set(PlanarState.COLUMNS)


def test_biases_of_a_robot_s_sensors_are_worn_for_a_whole_episode():
    spec = replace(PLATFORM.sensors.odometry, position=Channel(bias_std=0.1))
    robot = replace(PLATFORM, sensors=replace(PLATFORM.sensors, odometry=spec))
    simulation = build(load_scenario("nominal"), robot, dtype=np.float64)
    first = simulation.measured.x - simulation.truth.x
    run(simulation, 10)
    np.testing.assert_allclose(simulation.measured.x - simulation.truth.x, first, rtol=0, atol=1e-12)
    simulation.reset([0])
    changed = np.abs(simulation.measured.x - simulation.truth.x - first) > 1e-9
    assert changed.tolist() == [True, False, False, False, False]


def test_a_kick_comes_once_in_a_while_and_changes_the_velocity_by_force_times_time_over_mass():
    calm = build(STILL, dtype=np.float64)
    kicked = build(replace(STILL, kick=Kick(force=1.0, every_s=(2.0, 3.0))), dtype=np.float64)
    jumps = []
    for _ in range(25):
        for simulation in (calm, kicked):
            simulation.step(np.zeros((5, 8)))
        jumps.append(np.hypot(kicked.truth.vx - calm.truth.vx, kicked.truth.vy - calm.truth.vy))
    change = np.diff(np.array(jumps), axis=0)
    share = kicked.world.kick * kicked.control_dt / PLATFORM.body.mass
    for world in range(5):  # two kicks in the same direction in five seconds
        hits = change[:, world][change[:, world] > 1e-9]
        np.testing.assert_allclose(hits, share[world], rtol=1e-9)
        assert len(hits) in (1, 2)
    assert not np.array(jumps)[:10].any()  # none in the first two seconds


def test_late_commands_act_after_their_delay_and_not_before():
    late = build(replace(STILL, actuation=Actuation(delay_s=0.15)), dtype=np.float64)
    prompt = build(STILL, dtype=np.float64)
    for simulation in (late, prompt):
        simulation.step(np.eye(8)[[0] * 5])
    delay = late.world.action_delay
    share = 1.0 - np.ceil(delay / 0.02 - 0.5) * 0.02 / 0.2
    np.testing.assert_allclose(late.truth.yaw_rate, prompt.truth.yaw_rate * share, rtol=1e-9)


@pytest.mark.parametrize("control_hz", [5.0, 10.0, 25.0])
def test_a_delay_is_the_same_at_every_command_rate(control_hz):
    always = replace(STILL, actuation=Actuation(delay_s=0.14, least_delay=1.0))
    late = build(always, dtype=np.float64, control_hz=control_hz)
    prompt = build(STILL, dtype=np.float64, control_hz=control_hz)
    for _ in range(round(0.4 * control_hz)):
        for simulation in (late, prompt):
            simulation.step(np.eye(8)[[0] * 5])
    np.testing.assert_allclose(late.truth.yaw_rate, prompt.truth.yaw_rate * (0.4 - 0.14) / 0.4, rtol=1e-9)


def test_a_command_may_be_late_by_several_control_steps():
    late = build(replace(STILL, actuation=Actuation(delay_s=0.5)), dtype=np.float64)
    prompt = build(STILL, dtype=np.float64)
    courses = []
    for step in range(5):
        for simulation in (late, prompt):
            simulation.step(np.eye(8)[[0] * 5] * (step == 0))
        courses.append(late.truth.yaw_rate / prompt.truth.yaw_rate)
    begun = np.ceil(late.world.action_delay / 0.02 - 0.5) * 0.02
    for step, course in enumerate(courses, start=1):  # a pulse of one control step of 0.2 s, later
        np.testing.assert_allclose(course, np.clip((step * 0.2 - begun) / 0.2, 0.0, 1.0), atol=1e-9)


def test_valves_open_late_whether_the_robot_or_the_scenario_says_so():
    own = replace(PLATFORM.actuators, response=replace(PLATFORM.actuators.response, opening_delay_s=0.06))
    slow_robot = build(robot=replace(PLATFORM, actuators=own))
    slow_scenario = build(replace(STILL, actuation=Actuation(opening_delay_s=(0.06, 0.06))))
    for slow in (slow_robot, slow_scenario):
        prompt = build()
        for simulation in (slow, prompt):
            simulation.step(np.eye(8)[[0] * 5])
        share = 1.0 - 0.06 / slow.control_dt
        np.testing.assert_allclose(slow.truth.yaw_rate, prompt.truth.yaw_rate * share, rtol=1e-5)


def test_a_valve_that_failed_does_nothing_and_the_others_share_the_line():
    broken = build(replace(STILL, actuation=Actuation(failures=8, failure_chance=1.0)))
    broken.step(np.ones((5, 8)))
    assert not broken.truth.vx.any()
    assert np.all(broken.command == 1.0)  # it was commanded to


def test_noise_of_the_actuators_is_new_at_each_step_and_has_a_stream_of_its_own():
    assert ACTUATOR_NOISE != START
    simulation = build(replace(STILL, actuation=Actuation(noise=0.2)), BASE, worlds=2000, dtype=np.float64)
    errors = []
    for _ in range(2):
        simulation.step(np.full((2000, 2), 0.05))  # within one step's slew
        errors.append(simulation._actuation._wanted - 0.05)
    most = 0.2 * BASE.actuators.scale
    assert np.all(np.abs(errors) <= most[:, None])
    assert np.abs(errors).max(axis=(0, 2)) == pytest.approx(most, rel=0.05)
    assert abs(np.corrcoef(errors[0][0], errors[1][0])[0, 1]) < 4.0 / np.sqrt(2000)
    assert abs(np.corrcoef(errors[0][0], errors[0][1])[0, 1]) < 4.0 / np.sqrt(2000)


def test_a_centre_of_mass_beside_the_origin_turns_a_body_that_is_pushed_straight():
    heavy = replace(PLATFORM, uncertainty=replace(PLATFORM.uncertainty, center_of_mass=0.05))
    simulation = build(replace(STILL, body="uncertain"), heavy, dtype=np.float64)
    straight = np.zeros((5, 8))
    straight[:, [2, 7]] = 1.0  # 1 N together, ahead and left, without a moment about the origin
    simulation.step(straight)
    world = simulation.world
    turn = (world.com_y - world.com_x) * np.sqrt(0.5) * 0.2 / world.yaw_inertia
    np.testing.assert_allclose(simulation.truth.yaw_rate, turn, rtol=1e-6)
