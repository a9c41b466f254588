"""Between command and actuator: control steps, delays and noise, in lock step and tick by tick."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.mock_backend import MockBackend
from sim_nodes.mujoco_backend import MujocoBackend
from sim_nodes.one_world import OneWorld
from tests.states import planar_state

ROBOT = load_robot("floating_platform")  # ten ticks to a control step
HERE = planar_state(0.0, 0.0, 0.0)
FIRST, SECOND = np.eye(8)[0], np.eye(8)[1]
DT = ROBOT.timing.physics_dt


def late(delay_s):
    response = replace(ROBOT.actuators.response, delay_s=delay_s)
    return replace(ROBOT, actuators=replace(ROBOT.actuators, response=response))


def begun(robot, episode, noisy=False, **world):
    one = OneWorld(robot, noisy=noisy)
    one.reset(episode(robot, **world), HERE, seed=1, number=2)
    return one


def ticks(one, command, count, at_once):
    """What the actuators do at each of some ticks, and their gains, shapes (count, 8)."""
    applied, gains = [], []
    for _ in range(count // at_once):
        one.begin(command, at_once, HERE)
        for _ in range(at_once):
            applied.append(one.actuation.advance(DT, latest_s=one.latest_s)[:, 0])
            gains.append(one.actuation.gain[:, 0])
        one.measure(HERE)
    return np.array(applied), np.array(gains)


@pytest.mark.parametrize("at_once", [1, 10], ids=["tick by tick", "in lock step"])
def test_a_delay_counts_from_the_change_of_the_command_alone(episode, at_once):
    one = begun(late(0.06), episode)
    applied, _ = ticks(one, FIRST, 30, at_once)
    np.testing.assert_array_equal(applied[:, 0], [0.0] * 3 + [1.0] * 27)
    applied, _ = ticks(one, SECOND, 30, at_once)
    np.testing.assert_array_equal(applied[:, 0], [1.0] * 3 + [0.0] * 27)


@pytest.mark.parametrize("at_once", [1, 10], ids=["tick by tick", "in lock step"])
def test_a_pulse_shorter_than_its_delay_is_applied_whole_afterwards(episode, at_once):
    one = begun(late(0.5), episode)  # 25 ticks
    applied = [ticks(one, command, 10, at_once)[0][:, 0] for command in (FIRST, SECOND, SECOND, SECOND)]
    np.testing.assert_array_equal(np.concatenate(applied), [0.0] * 25 + [1.0] * 10 + [0.0] * 5)


def test_a_command_that_changes_between_control_steps_acts_at_once(episode):
    one = begun(ROBOT, episode)
    ticks(one, FIRST, 3, 1)
    applied, _ = ticks(one, SECOND, 1, 1)
    assert applied[0, 1] == 1.0


def test_noise_is_drawn_anew_once_a_control_step_also_tick_by_tick(episode):
    _, slow = ticks(begun(ROBOT, episode, action_noise=0.1), FIRST, 40, 10)
    _, fast = ticks(begun(ROBOT, episode, action_noise=0.1), FIRST, 40, 1)
    assert len(np.unique(slow[:, 0])) == 4
    np.testing.assert_array_equal(fast, slow)


def test_failed_valves_stay_closed_whatever_is_commanded(episode):
    applied, _ = ticks(begun(ROBOT, episode, alive=[0.0, *[1.0] * 7]), np.ones(8), 10, 10)
    assert not applied[:, 0].any()
    assert applied[:, 1:].all()


@pytest.mark.parametrize("at_once", [1, 10], ids=["tick by tick", "in lock step"])
def test_a_kick_comes_with_its_period_and_lasts_a_control_step(episode, at_once):
    one = begun(ROBOT, episode, kick=0.5, kick_period=1.01, kick_direction=0.0)
    forces = []
    for _ in range(150 // at_once):
        one.begin(FIRST, at_once, HERE)
        forces += [one.outside[0][0]] * at_once
    np.testing.assert_allclose(forces, [0.0] * 60 + [0.5] * 10 + [0.0] * 40 + [0.5] * 10 + [0.0] * 30)


def place(at):
    return planar_state(float(at), 0.0, 0.0)


@pytest.mark.parametrize("at_once", [1, 10], ids=["tick by tick", "in lock step"])
def test_late_odometry_is_as_late_as_its_world_says(episode, at_once):
    exact = replace(ROBOT.sensors.odometry, position=replace(ROBOT.sensors.odometry.position, std=0.0))
    robot = replace(ROBOT, sensors=replace(ROBOT.sensors, odometry=exact))
    one = begun(robot, episode, noisy=True, noise=1.0, sensor_delay=0.4)
    seen = []
    for k in range(at_once, 101, at_once):  # the robot is where its tick's number says
        one.begin(FIRST, at_once, place(k - at_once))
        seen.append(one.measure(place(k)).position_in_world[0])
    wanted = [max(0.0, k - 20) for k in range(at_once, 101, at_once)]
    np.testing.assert_allclose(seen, wanted)


def test_lost_measurements_repeat_the_one_before(episode):
    one = begun(ROBOT, episode, noisy=True, dropout=0.5)
    seen = []
    for k in range(100):
        one.begin(FIRST, 10, HERE)
        seen.append(one.measure(place(k)).position_in_world[0])
    repeated = np.mean(np.diff(seen) == 0.0)
    assert 0.3 < repeated < 0.7


@pytest.mark.parametrize("make", [MujocoBackend, lambda robot, sensor_noise: MockBackend(robot)])
@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_control_step_of_another_rate_is_the_same_tick_by_tick(make, factor):
    """Commands stay for two periods, which only the caller can tell from one; noise is drawn for each of them."""
    robot = load_robot("floating_platform")
    task, scenario = load_task("go_to_pose"), load_scenario("drift_action_noise")
    episode = draw_episode(robot, task, scenario, seed=5, number=0)
    ticks = robot.timing.substeps(factor * robot.timing.control_hz)
    command = np.array([1.0, 0.0] * 4)
    ends, inferred = [], []
    for way in ("at once", "tick by tick", "inferred"):
        backend = make(robot, sensor_noise=False)
        backend.reset(episode, seed=5)
        for step in range(6):
            held = command * (step // 2 % 2)
            if way == "at once":
                sample = backend.step(held, ticks)
                continue
            for tick in range(ticks):
                begins = (0 if tick else ticks) if way == "tick by tick" else None
                sample = backend.step(held, begins=begins)
        (inferred if way == "inferred" else ends).append(sample.truth.position_in_world)
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)
    assert np.abs(ends[0] - inferred[0]).max() > 1e-6
