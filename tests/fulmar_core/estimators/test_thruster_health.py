"""Thruster health from commands and odometry alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names
from fulmar_core.estimators.actuator_health.filters import HealthSettings
from fulmar_core.estimators.actuator_health.thruster_health import ThrusterHealth, can_estimate_health
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.parts import Actuation, Push, Wave
from fulmar_core.worlds.scenario import Scenario, load_scenario

ROBOTS = {name: load_robot(name) for name in config_names("robots")}
PLATFORM, TASK = ROBOTS["floating_platform"], load_task("drift_go_to_pose")
STILL = Scenario("nothing happens", sensor_noise=False, body="nominal")
DT = 0.2
WORLDS = 32


class Run:
    """Worlds whose valves open at random, one or two at a time, and an estimator that looks on."""

    def __init__(self, scenario, *, robot=PLATFORM, worlds=WORLDS, seed=3):
        self.simulation = BatchSimulation(
            robot, TASK, scenario, worlds=worlds, seed=seed, control_hz=1.0 / DT
        )
        self.health = ThrusterHealth(robot)
        self.rng = np.random.default_rng(seed)
        self.dead = np.asarray(self.simulation.world.alive).T < 0.5
        self.believed = self.health.see(self.simulation.measured, np.zeros((worlds, 8)), DT)

    def go(self, steps, *, valves=2):
        """Belief in each valve after each step, shape (steps, worlds, 8)."""
        seen = []
        for _ in range(steps):
            lots = self.rng.uniform(size=(self.simulation.worlds, 8))
            command = (lots.argsort(axis=1).argsort(axis=1) < self.rng.integers(0, valves + 1)).astype(float)
            self.simulation.step(command)
            self.believed = self.health.see(self.simulation.measured, command, DT)
            seen.append(self.believed.effectiveness)
        return np.array(seen)


CONDITIONS = [name for name in config_names("scenarios") if name.startswith("drift_")]


@pytest.mark.parametrize("name", CONDITIONS)
def test_under_every_condition_of_the_benchmark_lost_valves_are_found_and_no_other_is_accused(name):
    run = Run(load_scenario(name))
    seen = run.go(75)
    working = np.broadcast_to(~run.dead, seen.shape)
    assert seen[working].min() > 0.5
    assert np.all(seen[-1][run.dead] < 0.1)
    assert np.all(run.believed.alive == ~run.dead)


def test_a_lost_valve_is_found_with_its_first_or_second_command():
    scenario = replace(STILL, actuation=Actuation(failures=1, failure_chance=1.0))
    run = Run(scenario)
    before = run.believed
    for _ in range(2):
        command = run.dead.astype(float)
        run.simulation.step(command)
        run.believed = run.health.see(run.simulation.measured, command, DT)
    assert np.all(before.effectiveness > 0.9)
    assert np.all(run.believed.effectiveness[run.dead] < 0.2)
    assert np.all(run.believed.effectiveness[~run.dead] > 0.8)


def test_force_and_torque_from_outside_are_distinguished_from_lost_valves():
    scenario = replace(
        STILL, push=Push(0.2, 0.16, least=1.0), actuation=Actuation(failures=2, failure_chance=1.0)
    )
    run = Run(scenario)
    run.go(100)
    world, push = run.simulation.world, run.believed.push
    np.testing.assert_allclose(push[:, 0], world.force_x, atol=0.06)
    np.testing.assert_allclose(push[:, 1], world.force_y, atol=0.06)
    np.testing.assert_allclose(push[:, 2], world.torque, atol=0.02)
    assert np.all(run.believed.alive == ~run.dead)


def test_a_valve_that_dies_in_the_middle_of_an_episode_is_found_and_one_that_comes_back_is_believed_again():
    run = Run(STILL, worlds=4)
    run.go(50)
    run.simulation.world.alive[2] = 0.0
    seen = run.go(75)
    assert np.all(seen[-1][:, 2] < 0.1)
    run.simulation.world.alive[2] = 1.0
    seen = run.go(75)
    assert np.all(seen[-1] > 0.9)


def test_what_is_never_commanded_is_neither_accused_nor_acquitted():
    run = Run(replace(STILL, push=Push(0.1, 0.0, least=1.0)), worlds=4)
    for _ in range(50):
        run.simulation.step(np.zeros((4, 8)))
        run.believed = run.health.see(run.simulation.measured, np.zeros((4, 8)), DT)
    np.testing.assert_allclose(run.believed.effectiveness, 1.0 - HealthSettings().failure, atol=0.01)
    np.testing.assert_allclose(np.hypot(*run.believed.push[:, :2].T), 0.1, atol=0.01)


def test_an_uneven_floor_is_no_lost_valve():
    run = Run(replace(STILL, wave=Wave(0.2, least=1.0, wave_number=(3.0, 3.0))))
    assert run.go(100).min() > 0.5


@pytest.mark.parametrize("shared", [True, False], ids=["one pressure line", "a pressure line each"])
def test_valves_that_open_by_degrees_are_estimated_as_well(shared):
    robot = ROBOTS["modular_freeflyer"]
    robot = replace(robot, actuators=replace(robot.actuators, shared_pressure=shared))
    run = Run(replace(STILL, actuation=Actuation(failures=1, failure_chance=1.0)), robot=robot)
    run.go(60)
    assert np.all(run.believed.alive == ~run.dead)


def test_one_robot_is_estimated_as_in_a_batch():
    many = Run(load_scenario("drift_one_lost"), worlds=3)
    alone = ThrusterHealth(PLATFORM)
    rng = np.random.default_rng(1)
    one = None
    for step in range(30):
        command = (rng.uniform(size=(3, 8)) > 0.8).astype(float)
        many.simulation.step(command)
        all_three = many.health.see(many.simulation.measured, command, DT)
        if step == 0:
            many.health.reset()
            all_three = many.health.see(many.simulation.measured, command, DT)
        one = alone.see(many.simulation.measured[1], command[1], DT)
    assert one is not None
    np.testing.assert_allclose(one.effectiveness, all_three.effectiveness[1], atol=1e-6)
    np.testing.assert_allclose(one.push, all_three.push[1], atol=1e-6)


def test_after_a_reset_nothing_of_the_past_counts():
    run = Run(load_scenario("drift_two_lost"), worlds=4)
    run.go(60)
    assert run.believed.effectiveness.min() < 0.1
    run.health.reset()
    fresh = run.health.see(run.simulation.measured, np.zeros((4, 8)), DT)
    assert fresh.effectiveness.min() > 0.9
    assert not fresh.push.any()


def test_a_turn_across_the_half_circle_is_no_surprise():
    health = ThrusterHealth(PLATFORM)
    zero = np.float64(0.0)
    for k in range(20):
        yaw = np.float64((3.0 + 0.1 * k + np.pi) % (2.0 * np.pi) - np.pi)
        believed = health.see(PlanarState(zero, zero, yaw, zero, zero, np.float64(0.5)), np.zeros(8), DT)
    assert abs(believed.push[2]) < 1e-3


def test_robots_that_roll_or_swim_are_refused():
    for name, robot in ROBOTS.items():
        assert can_estimate_health(robot) == robot.air_bearing, name
    with pytest.raises(ConfigError, match="kingfisher"):
        ThrusterHealth(ROBOTS["kingfisher"])


def test_settings_without_meaning_are_refused():
    with pytest.raises(ValueError, match="greater than 0"):
        HealthSettings(velocity=0.0)
    with pytest.raises(ValueError, match="one half"):
        HealthSettings(failure=0.6)
