"""JSBSim's own L17 and c172x as plants: rigged, steered the documented way, and held by LQI of our own airframes."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.classical import gains_of
from fulmar_core.controllers.flight_lqi import FlightLqi
from fulmar_core.dynamics.flight_trim import find_trim, flying_at
from fulmar_core.loop.rollout import roll_out_in_backends
from fulmar_core.robots.jsbsim_models import jsbsim_model
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.jsbsim_backend import JsbsimBackend

OWN = {"L17": load_robot("navion"), "c172x": load_robot("cessna_182")}
IDEAL = load_scenario("ideal")


@functools.cache
def backend_of(model):
    return JsbsimBackend(OWN[model], model=model, sensor_noise=False)


def task_at(height, robot, seconds=10.0):
    return replace(load_task("fly_hold"), height=(height, height), episode_s=seconds).fitted(robot)


def level_start(model, *, seed=1):
    """An episode that begins in level flight of the robot's own, at 300 m, with the wind of a scenario."""
    robot = OWN[model]
    drawn = draw_episode(robot, task_at(300.0, robot), load_scenario("light_turbulence"), seed=seed, number=0)
    trim = find_trim(robot, backend_of(model).craft.speed).state
    return replace(drawn, start=replace(trim, z=np.asarray(300.0)))


def flown(model, *, offset=(0.0, 0.0, 0.0), throttle=0.7, ticks=100, seed=1, scenario="ideal"):
    """The last sample of a flight at the robot's deflections of level flight and some more."""
    robot, backend = OWN[model], backend_of(model)
    episode = level_start(model, seed=seed)
    if scenario == "ideal":
        world = draw_episode(robot, task_at(300.0, robot), IDEAL, seed=seed, number=0).world
        episode = replace(episode, world=world)
    command = find_trim(robot, backend.craft.speed).command + np.array([*offset, 0.0])
    command[3] = throttle
    backend.reset(episode, seed=seed)
    return [backend.step(command) for _ in range(ticks)][-1]


def test_a_dead_motor_does_not_begin_at_the_throttle_of_the_trim():
    backend, episode = backend_of("L17"), level_start("L17")
    episode.world.alive[3] = 0.0
    backend.reset(episode, seed=1)
    applied = backend._world.actuation.applied[:, 0]
    assert applied[3] == 0.0
    assert backend._model["fcs/throttle-cmd-norm[0]"] == 0.0


@pytest.mark.parametrize("model", OWN)
def test_a_start_is_the_episodes_own_whatever_the_models_axes(model):
    pose = SpatialState.target_at((30.0, -20.0, 50.0, 10.0, -5.0, 70.0))
    start = replace(flying_at(OWN[model], pose), wx=np.asarray(0.1), wy=np.asarray(-0.2), wz=np.asarray(0.3))
    truth = backend_of(model).reset(replace(level_start(model), start=start), seed=1).truth
    wanted = start.to_rigid()
    for name in ("position_in_world", "quat_xyzw", "velocity_in_world", "angular_velocity_in_body"):
        np.testing.assert_allclose(getattr(truth, name), getattr(wanted, name), rtol=0, atol=1e-6)


@pytest.mark.parametrize("model", OWN)
@pytest.mark.parametrize(("surface", "axis"), [(0, 1), (1, 0), (2, 2)], ids=["elevator", "aileron", "rudder"])
def test_a_surface_turns_the_craft_about_its_own_axis_the_documented_way(model, surface, axis):
    """Nose down is +y, right wing down +x, nose to the left +z of the body (x ahead, y left, z up)."""
    offset = [0.0, 0.0, 0.0]
    rates = []
    for way in (-0.08, 0.08):
        offset[surface] = way
        rates.append(flown(model, offset=offset, ticks=25).truth.angular_velocity_in_body)
    turn = rates[1] - rates[0]
    assert turn[axis] > 0.03
    assert turn[axis] == np.abs(turn).max()


@pytest.mark.parametrize(("model", "within"), [("L17", 5e-4), ("c172x", 5e-3)])
def test_deflections_in_radians_are_those_of_the_model(model, within):
    """Further in one direction, where the play of the c172x's elevator keeps but our servo's overshoot, 4.3 %."""
    moved = []
    for offset in (0.08, 0.18):
        flown(model, offset=(offset, 0.0, offset), ticks=60)
        moved.append([backend_of(model)._model[f"fcs/{name}-pos-rad"] for name in ("elevator", "rudder")])
    np.testing.assert_allclose(np.subtract(moved[1], moved[0]), 0.1, rtol=0, atol=within)


def test_a_rigged_craft_flies_level_at_the_deflections_of_our_own_trim():
    """For three seconds hands off; its throttle begins at idle. The elevator of the c172x plays by too much for it."""
    craft = backend_of("L17").craft
    truth = flown("L17", throttle=craft.throttle, ticks=300).truth
    assert truth.position_in_world[2] == pytest.approx(300.0, abs=1.0)
    assert truth.position_in_world[1] == pytest.approx(0.0, abs=1.0)
    assert np.linalg.norm(truth.velocity_in_world) == pytest.approx(craft.speed, rel=0.03)


def test_more_throttle_makes_it_faster():
    speeds = [
        np.linalg.norm(flown("L17", throttle=level, ticks=150).truth.velocity_in_world)
        for level in (0.3, 1.0)
    ]
    assert speeds[1] > speeds[0] + 0.2


@pytest.mark.parametrize("model", OWN)
def test_a_seed_repeats_a_flight_in_turbulence_to_the_last_bit(model):
    first, again, other = (
        flown(model, ticks=50, seed=seed, scenario="light_turbulence") for seed in (1, 1, 2)
    )
    assert np.array_equal(first.truth.position_in_world, again.truth.position_in_world)
    assert np.array_equal(first.truth.quat_xyzw, again.truth.quat_xyzw)
    assert not np.array_equal(first.truth.position_in_world, other.truth.position_in_world)


# The elevator of the c172x has a play of 0.05 rad, in which the default weights make it swing without end.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "softer", "within"), [("L17", {}, 0.01), ("c172x", {"surface": 2000.0}, 0.5)]
)
def test_lqi_of_our_own_airframe_holds_its_height(model, softer, within):
    robot = OWN[model]
    task = task_at(20.0, robot, seconds=30.0)
    gains = replace(gains_of(robot, "lqi"), **softer)
    controller = FlightLqi(robot, task, gains, control_hz=100.0)
    run = roll_out_in_backends(controller, lambda: backend_of(model), task, IDEAL, episodes=1, seed=3)
    assert not run.touching.any()
    assert run.position_error[0, 0] > 0.2  # it does not begin there
    assert run.position_error[0, 1000:].max() < within


def test_models_that_do_not_stand_for_a_robot_are_refused_with_the_nearest_one():
    navion = OWN["L17"]
    assert jsbsim_model(navion, "jsbsim:L17") == "L17"
    assert jsbsim_model(navion, "jsbsim") == ""
    for robot, backend, words in (
        (navion, "jsbsim:l17", r"'l17' does not stand for 'navion'\. Did you mean 'L17'\?"),
        (navion, "jsbsim:c172x", r"'c172x' does not stand for 'navion'\. Known: L17\."),
        (navion, "jsbsim:", r"'' does not stand for 'navion'\. Known: L17\."),
        (load_robot("airship_v7"), "jsbsim:L17", "no model of JSBSim's own stands for 'airship_v7'"),
        (load_robot("turtlebot2"), "jsbsim:L17", "flies aircraft only"),
    ):
        with pytest.raises(ConfigError, match=words) as error:
            jsbsim_model(robot, backend)
        assert "\n" not in str(error.value)


def test_a_robots_file_that_names_what_jsbsim_does_not_have_is_refused():
    with pytest.raises(ConfigError, match=r"comes with no model 'L71'\. Did you mean 'L17'\?"):
        JsbsimBackend(OWN["L17"], model="L71")
    with pytest.raises(ConfigError, match=r"'mk82' does not move its elevator by fcs/elevator-cmd-norm"):
        JsbsimBackend(OWN["L17"], model="mk82")
    with pytest.raises(ConfigError, match=r"'SGS' holds no level flight between 42.9 m/s and 53.6 m/s"):
        JsbsimBackend(OWN["L17"], model="SGS")  # a glider
    with pytest.raises(ConfigError, match=r"JSBSim cannot fly its 'f104': .* does not exist"):
        JsbsimBackend(OWN["L17"], model="f104")
