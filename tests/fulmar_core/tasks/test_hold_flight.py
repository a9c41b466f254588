"""Attitude and airspeed are held, and level flight comes back after an upset; by LQI, in free air."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_path
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.controllers.classical import gains_of, load_classical
from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.flight_hold import FlightHold
from fulmar_core.controllers.flight_lqi import FlightLqi, HoldWeights
from fulmar_core.loop.rollout import roll_out_in_batch
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.metrics import successes
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.attitude import euler_of, exponential, from_euler, length, product
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.flight_terms import angle_of_attack, is_lost, tilt_error
from fulmar_core.tasks.goal import goals_at
from fulmar_core.tasks.hold_flight import HoldAttitude
from fulmar_core.worlds.scenario import Scenario, load_scenario

ROBOT = load_robot("airship_v7")
EXACT = Scenario("exact", sensor_noise=False, body="nominal")


def briefly(name, seconds):
    task = load_task(name).fitted(ROBOT)
    return replace(task, episode_s=seconds, tolerance=replace(task.tolerance, hold_s=0.5))


def exactly(task):
    """The LQI with the state as it is."""
    return FlightHold(ROBOT, task, replace(gains_of(ROBOT, "lqi"), observer=None))


@pytest.mark.parametrize(
    ("name", "seconds"), [("fly_recover", 4.0), pytest.param("fly_airspeed", 8.0, marks=pytest.mark.slow)]
)
def test_lqi_does_it(name, seconds):
    task = briefly(name, seconds)
    run = roll_out_in_batch(exactly(task), ROBOT, task, EXACT, episodes=16, seed=2)
    assert successes(run, task).all()


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["airship_v7", "volantex_ranger"])
@pytest.mark.parametrize("law", ["lqi", "lqr"])
def test_level_flight_comes_back_with_noise_from_every_attitude_within_sixty_degrees(robot, law):
    craft, task = load_robot(robot), load_task("fly_recover")
    controller = load_classical(craft, task, law=law)
    run = roll_out_in_batch(controller, craft, task, load_scenario("nominal"), episodes=64, seed=1)
    assert successes(run, task).mean() >= 0.95


@pytest.mark.slow
def test_a_bank_is_flown_as_a_turn_without_sideslip():
    task = briefly("fly_attitude", 6.0)
    law, sim = exactly(task), BatchSimulation(ROBOT, task, EXACT, worlds=2, seed=1, dtype=np.float64)
    banks = np.deg2rad([25.0, -25.0])
    level = tuple(np.full(2, float(part)) for part in law._quats[0])
    quat = product(from_euler(banks, 0.0 * banks, 0.0 * banks), level)
    goal = goals_at(np.stack((0.0 * banks, 0.0 * banks, 0.0 * banks + 300.0, *quat), axis=-1))
    for step in range(500):
        inputs = Inputs(sim.measured, goal, np.zeros((2, 0)), sim.command, None, step, 0.01)
        sim.move(law.act(inputs))
    state = sim.truth
    np.testing.assert_allclose(euler_of(state.quat)[0], banks, rtol=0, atol=0.01)
    speed = length(state.velocity)
    np.testing.assert_allclose(state.velocity_in_body[1] / speed, 0.0, rtol=0, atol=0.02)
    turning = np.arctan2(state.vy, state.vx)
    assert turning[0] < -0.5, "the right wing is low, so that it turns to the right"
    assert turning[1] > 0.5


def test_commands_do_not_depend_on_the_heading_or_the_place():
    task = briefly("fly_attitude", 6.0)
    start, goal = task.draw(Draws(4, np.arange(8), np.zeros(8)), ROBOT, training=False)
    upset = replace(start, wx=start.wx + 0.1, vz=start.vz + 1.0)
    about = exponential((0.0 * start.x, 0.0 * start.x, 0.0 * start.x + 2.0))
    c, s = math.cos(2.0), math.sin(2.0)
    turned = replace(
        SpatialState(
            upset.x + 50.0, upset.y - 20.0, upset.z, *product(about, upset.quat),
            c * upset.vx - s * upset.vy, s * upset.vx + c * upset.vy, upset.vz, *upset.rate,
        )
    )  # fmt: skip
    previous = np.tile(ROBOT.actuators.safe_command, (8, 1))
    commands = []
    for state in (upset, turned):
        law, sent = load_classical(ROBOT, task), previous
        for step in range(5):  # from the second on the observer corrects what it believes
            sent = law.act(Inputs(state, goal, np.zeros((8, 0)), sent, None, step, 0.01))
        commands.append(sent)
    np.testing.assert_allclose(commands[1], commands[0], rtol=0, atol=1e-9)


def test_an_upset_begins_as_far_from_level_as_the_file_says_with_the_air_as_in_level_flight():
    task = load_task("fly_recover").fitted(ROBOT)
    start, goal = task.draw(Draws(4, np.arange(400), np.zeros(400)), ROBOT, training=False)
    tilt = np.rad2deg(task.errors(start, goal).attitude)
    assert tilt.max() <= 60.0
    assert tilt.max() > 50.0, "the axis is any one, and about the vertical nothing tilts"
    np.testing.assert_allclose(length(start.velocity), ROBOT.airframe.speed)
    np.testing.assert_allclose(angle_of_attack(start), angle_of_attack(start)[0], atol=1e-9)
    assert not is_lost(start, ROBOT).any()
    assert (start.z == 300.0).all()


def test_a_tilt_is_the_rotation_that_undoes_it_without_the_heading():
    level = tuple(map(np.asarray, (0.0, 0.0, 0.0, 1.0)))
    for turn, expected in (((0.3, 0.0, 0.0), (0.3, 0.0, 0.0)), ((0.0, -0.2, 0.0), (0.0, -0.2, 0.0))):
        there = exponential(tuple(map(np.asarray, turn)))
        np.testing.assert_allclose(tilt_error(there, level), expected, atol=1e-12)
    heading = exponential((np.asarray(0.0), np.asarray(0.0), np.asarray(1.0)))
    np.testing.assert_allclose(tilt_error(heading, level), 0.0, atol=1e-9)


def test_the_law_of_a_name_is_that_of_the_task():
    assert type(load_classical(ROBOT, load_task("fly_recover"))) is FlightHold
    assert type(load_classical(ROBOT, load_task("fly_hold"))) is FlightLqi
    with pytest.raises(ValueError, match="holds attitude or airspeed, and 'fly_hold' is about neither"):
        FlightHold(ROBOT, load_task("fly_hold"), gains_of(ROBOT, "lqi"))


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("tilt_deg: [0.0, 60.0]", "tilt_deg: [60.0, 0.0]", "'tilt_deg' must be"),
        ("height: [300.0, 300.0]", "height: [0.0, 300.0]", "'height' must be greater than 0"),
        ("title:", "bank_deg: [-70, 0]\ntitle:", "'bank_deg' must be .* within ±60"),
    ],
)
def test_a_mistake_in_the_file_is_one_line(tmp_path, old, new, says):
    text = config_path("tasks", "fly_recover").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "fly_recover.yaml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ConfigError, match=says) as caught:
        load_config(HoldAttitude, path)
    assert "\n" not in str(caught.value)


def test_an_airspeed_that_the_craft_cannot_fly_is_one_clear_line():
    task = replace(load_task("fly_airspeed"), speed=(0.5, 1.0))
    with pytest.raises(ConfigError, match=r"has no trim at 14 m/s and in free air"):
        load_classical(ROBOT, task)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"angle_integral": 0.0}, "all be 0"),
        ({"speed_integral": -1.0}, "all be 0"),
        ({"attack_margin_deg": 0.0}, "attack_margin_deg must be greater than 0"),
        ({"lead_s": -0.1}, "lead_s not negative"),
    ],
)
def test_weights_that_cannot_be_are_refused(change, says):
    with pytest.raises(ValueError, match=says):
        HoldWeights(**change)


def test_a_start_on_the_ground_is_refused():
    task = load_task("fly_attitude")
    low = replace(task, start=replace(task.start, height=(0.1, 0.1)))
    with pytest.raises(
        ConfigError, match=r"starts at 0\.1 m, where the hull of 'airship_v7' touches the ground"
    ):
        low.check(ROBOT)


def test_the_identity_of_a_law_hangs_on_the_aerodynamics_and_the_task():
    task = load_task("fly_airspeed").fitted(ROBOT)
    other_craft = replace(ROBOT, airframe=replace(ROBOT.airframe, stall_deg=ROBOT.airframe.stall_deg + 1.0))
    identities = {
        load_classical(robot, played).metadata()["sha256"]
        for robot, played in ((ROBOT, task), (other_craft, task), (ROBOT, replace(task, speed=(0.95, 1.05))))
    }
    assert len(identities) == 3
