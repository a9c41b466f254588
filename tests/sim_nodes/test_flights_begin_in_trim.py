"""Aircraft begin in level flight through their own air, with actuators where that takes them, wherever they begin."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.dynamics.flight_trim import find_trim
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.watchdog import Watchdog
from fulmar_core.simulation.episode import draw_episode, draw_episodes
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.attitude import minus, turn_back
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.worlds.parts import Air
from fulmar_core.worlds.scenario import Scenario
from fulmar_ros.plant_settings import PlantSettings, first_episode
from policy_server.controllers import Choice, load_controller
from sim_nodes.jsbsim_backend import JsbsimBackend
from sim_nodes.mock_backend import MockBackend
from sim_nodes.mujoco_backend import MujocoBackend
from sim_nodes.one_world import OneWorld

ROBOT = load_robot("airship_v7")
TASK = load_task("fly_hold").fitted(ROBOT)
ABOVE_SEA = 1500.0
WINDY = Scenario("windy", sensor_noise=False, body="nominal", air=Air(wind=(8.0, 8.0), altitude=ABOVE_SEA))
BACKENDS = {
    "mock": MockBackend,
    "mujoco": lambda robot: MujocoBackend(robot, sensor_noise=False),
    "jsbsim": lambda robot: JsbsimBackend(robot, sensor_noise=False),
}


def flow(state, wind):
    """Airspeed [m/s], angle of attack and sideslip [rad] of one craft."""
    ahead, left, up = (float(part) for part in turn_back(state.quat, minus(state.velocity, tuple(wind))))
    speed = math.sqrt(ahead**2 + left**2 + up**2)
    return np.array([speed, math.atan2(-up, ahead), math.asin(-left / speed)])


def check(robot, state, command, wind, altitude=ABOVE_SEA):
    trim = find_trim(robot, robot.airframe.speed, float(state.z), altitude)
    np.testing.assert_allclose(flow(state, wind), [trim.speed, trim.alpha, 0.0], rtol=0, atol=1e-5)
    np.testing.assert_allclose(command, trim.command, rtol=0, atol=1e-5)


@pytest.mark.parametrize(
    ("name", "task"),
    [
        ("airship_v7", "fly_hold"),
        ("airship_v7", "fly_c"),
        ("airship_v7", "fly_attitude"),
        ("navion", "fly_airspeed"),
    ],
)
def test_drawn_flights_begin_in_trim_in_wind_above_the_sea(name, task):
    robot = load_robot(name)
    task = replace(load_task(task).fitted(robot), start=replace(load_task(task).start, tilt_deg=(0.0, 0.0)))
    drawn = draw_episodes(robot, task, WINDY, seed=3, numbers=np.arange(3))
    for number in range(3):
        one = drawn[number]
        assert math.hypot(*one.world.wind[:2]) == pytest.approx(8.0)
        check(robot, one.start, one.command, one.world.wind)


def test_a_flight_does_not_depend_on_those_beside_it():
    many, alone = (
        draw_episodes(ROBOT, TASK, WINDY, seed=3, numbers=np.array(each)) for each in ([5, 1, 9], [9])
    )
    np.testing.assert_allclose(many[2].start.columns(), alone[0].start.columns(), rtol=0, atol=1e-12)
    np.testing.assert_allclose(many[2].command, alone[0].command, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", BACKENDS)
def test_every_simulator_flies_on_as_it_began(name):
    backend, episode = BACKENDS[name](ROBOT), draw_episode(ROBOT, TASK, WINDY, seed=1, number=2)
    sample = backend.reset(episode, seed=1)
    check(
        ROBOT,
        SpatialState.from_rigid(sample.truth),
        sample.readings["surfaces"].value.positions,
        episode.world.wind,
    )
    for _ in range(25):
        sample = backend.step(episode.command)
    backend.close()
    began = episode.start.to_rigid()
    np.testing.assert_allclose(sample.truth.velocity_in_world, began.velocity_in_world, rtol=0, atol=0.01)
    np.testing.assert_allclose(sample.truth.angular_velocity_in_body, 0.0, rtol=0, atol=2e-3)


def test_jsbsim_begins_in_the_wind_that_blows():
    backend, episode = BACKENDS["jsbsim"](ROBOT), draw_episode(ROBOT, TASK, WINDY, seed=1, number=2)
    felt = backend.reset(episode, seed=1).readings["imu"].value.specific_force
    backend.close()
    # In level flight the air bears the craft, and no more.
    np.testing.assert_allclose(felt, turn_back(episode.start.quat, (0.0, 0.0, GRAVITY)), rtol=0, atol=0.02)


def test_worlds_of_a_batch_begin_in_trim_and_begin_so_again():
    batch = BatchSimulation(ROBOT, TASK, WINDY, worlds=3, seed=3, dtype=np.float64)
    for world in range(3):
        check(ROBOT, batch.truth[world], batch.command[world], batch.world.wind[:, world])
    batch.step(np.zeros((3, 5)))
    batch.reset([1])
    check(ROBOT, batch.truth[1], batch.command[1], batch.world.wind[:, 1])
    np.testing.assert_allclose(batch._actuation.applied[:, 1], batch.command[1], rtol=0, atol=0)
    assert abs(batch.command[0]).max() == 0.0


def test_what_is_dead_does_nothing_from_the_start():
    lost = replace(WINDY, actuation=replace(WINDY.actuation, failures=1, failure_chance=1.0))
    batch = BatchSimulation(ROBOT, TASK, lost, worlds=4, seed=3)
    assert (batch._actuation.applied[batch.world.alive == 0.0] == 0.0).all()
    assert (batch.world.alive == 0.0).any()


def test_what_is_dead_in_one_simulated_world_does_nothing_from_the_start():
    lost = replace(WINDY, actuation=replace(WINDY.actuation, failures=1, failure_chance=1.0))
    world, episode = OneWorld(ROBOT, noisy=False), draw_episode(ROBOT, TASK, lost, seed=3, number=0)
    episode = replace(episode, command=np.ones(len(ROBOT.actuators.names)))
    world.begin_episode(episode)
    alive = world.world.alive[:, 0]
    assert sorted(alive.tolist()) == [0.0, *(len(alive) - 1) * [1.0]]
    assert world.actuation.applied[:, 0].tolist() == alive.tolist()


@pytest.mark.parametrize("start", [(0.0, 0.0, 5.0), (3.0, 1.0, 4.0, 0.0, 0.0, 90.0)])
def test_a_live_plant_begins_in_trim_along_its_heading(start, monkeypatch, tmp_path):
    own = tmp_path / "scenarios" / "windy.yaml"
    own.parent.mkdir()
    air = f"air: {{wind: [8.0, 8.0], altitude: {ABOVE_SEA}}}"
    own.write_text(f"title: windy\nsensor_noise: false\nbody: nominal\n{air}\n")
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    settings = PlantSettings(robot="airship_v7", task="fly_hold", scenario="windy", start=start)
    episode = first_episode(ROBOT, settings)
    check(ROBOT, episode.start, episode.command, episode.world.wind)
    heading = SpatialState.written(episode.start.pose)[5]
    assert heading == pytest.approx(start[5] if len(start) > 3 else 0.0, abs=1e-6)


def test_an_attitude_that_is_written_is_kept_and_the_air_meets_it_as_in_level_flight():
    settings = PlantSettings(robot="airship_v7", task="fly_hold", start=(0.0, 0.0, 5.0, 20.0, -10.0, 30.0))
    episode = first_episode(ROBOT, settings)
    assert SpatialState.written(episode.start.pose)[3:] == pytest.approx((20.0, -10.0, 30.0), abs=1e-6)
    check(ROBOT, episode.start, episode.command, (0.0, 0.0, 0.0), altitude=0.0)


def test_a_controller_takes_it_that_actuators_are_at_trim_before_its_first_command():
    law = load_controller("lqi", ROBOT, TASK, Choice(ROBOT.timing.control_hz))
    loop, episode = (
        ControlLoop(ROBOT, TASK, law),
        draw_episodes(ROBOT, TASK, WINDY, seed=3, numbers=np.array([4])),
    )
    loop.begin(goal_in_float64(episode.goal))
    trim = find_trim(ROBOT, 28.0, float(episode.start.z[0])).command
    np.testing.assert_allclose(loop.inputs(episode.start, {}, 0).previous[0], trim, rtol=0, atol=1e-9)
    loop.step(episode.start, {}, 0)
    loop.rest(10_000_000)  # the safe controller flies meanwhile
    np.testing.assert_allclose(
        loop.inputs(episode.start, {}, 20_000_000).previous[0], trim, rtol=0, atol=1e-9
    )


def test_a_guard_hands_the_safe_controller_what_actuators_began_with():
    seen = []

    class Watched:
        longest_s, doing, stuck = math.inf, "", None

        def command(self, since_s, last, state):
            seen.append(last)
            return last

    guard = ActuatorGuard(ROBOT.actuators, Watchdog(200_000_000), refuge=Watched())
    guard.begin_with(find_trim(ROBOT, 28.0).command)
    guard.output(0)
    np.testing.assert_array_equal(seen[0], find_trim(ROBOT, 28.0).command)
