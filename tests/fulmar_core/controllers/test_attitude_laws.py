"""Laws that point satellites, and unload their wheels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.attitude_pd import AdaptiveAttitude, attitude_pd_gains
from fulmar_core.controllers.classical import check_pair, load_classical
from fulmar_core.loop.rollout import roll_out_in_batch
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.metrics import successes
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.simulation.trajectories import Trajectories
from fulmar_core.tasks import load_task
from fulmar_core.worlds.parts import InertiaChange, Push, Sensing, Solar
from fulmar_core.worlds.scenario import Scenario, load_scenario, sensors_in
from tests.inputs import inputs_of

CUBESAT = load_robot("cubesat_wheels")
ORBIT = load_scenario("low_orbit")
# A leak that fills a wheel in 92 s.
LEAK = Scenario("a leak", sensor_noise=False, body="nominal", push=Push(torque=0.05, least=1.0))
STILL = Scenario("nothing", sensor_noise=False, body="nominal")


def rolled(robot, task, law, scenario, **how) -> Trajectories:
    task = replace(load_task(task), **how)
    return roll_out_in_batch(load_classical(robot, task, law=law), robot, task, scenario, episodes=6, seed=5)


@pytest.mark.parametrize(
    ("name", "law"), [("cubesat_wheels", "lqr"), ("microsat", "adaptive"), ("smallsat", "pd")]
)
@pytest.mark.parametrize(
    ("task", "seconds"), [pytest.param("slew", 150.0, marks=pytest.mark.slow), ("point", 90.0)]
)
def test_every_law_slews_and_points_to_the_nadir(name, law, task, seconds):
    run = rolled(load_robot(name), task, law, ORBIT, episode_s=seconds)
    assert successes(run, load_task(task)).all()
    assert np.degrees(run.attitude_error[:, -50:]).max() < 0.01


def momenta(robot, scenario, seconds):
    """Largest share of a wheel's momentum at the end, and the attitude's error [deg], of a satellite that points."""
    task = load_task("point_inertial")
    simulation = BatchSimulation(robot, task, scenario, worlds=4, seed=2, dtype=np.float64)
    law = load_classical(robot, task, law="pd")
    for _ in range(round(seconds * law.control_hz)):
        inputs = replace(inputs_of(simulation), readings=simulation.readings)
        simulation.move(law.act(inputs))
    error = task.errors(simulation.truth, simulation.goal).attitude
    return np.abs(simulation.readings["wheels"]).max() / robot.actuators.top_speed, np.degrees(error.max())


# Smaller wheels are full sooner.
AS_THEY_ARE = pytest.param(1.0, 200.0, marks=pytest.mark.slow)


def wheels_of(size, **changed):
    """The satellite with wheels that hold a share of its momentum."""
    wheels = CUBESAT.actuators
    return replace(CUBESAT, actuators=replace(wheels, top_speed=size * wheels.top_speed, **changed))


@pytest.mark.parametrize(("size", "seconds"), [(0.25, 50.0), AS_THEY_ARE])
def test_without_unloading_a_leak_fills_the_wheels_and_the_satellite_is_lost(size, seconds):
    share, error = momenta(wheels_of(size, unloading=None), LEAK, seconds)
    assert share > 0.999
    assert error > 5.0


@pytest.mark.parametrize(("size", "seconds"), [(0.5, 90.0), AS_THEY_ARE])
def test_unloading_by_thrusters_keeps_the_wheels_free_and_the_satellite_pointed(size, seconds):
    unloading = replace(CUBESAT.actuators.unloading, kind="thrusters", torque=1e-3)
    share, error = momenta(wheels_of(size, unloading=unloading), LEAK, seconds)
    assert share < 0.9
    assert error < 2.0


def test_the_feed_forward_uses_the_momentum_of_the_wheels():
    task = load_task("point")
    simulation = BatchSimulation(CUBESAT, task, STILL, worlds=3, seed=1)
    law, inputs = load_classical(CUBESAT, task, law="pd"), inputs_of(simulation)
    turning = replace(inputs, state=replace(inputs.state, wx=np.full(3, 0.01)))
    spinning = replace(turning, readings={"wheels": np.full((3, 3), 200.0)})
    law.reset()
    without = law.act(turning)
    law.reset()
    with_wheels = law.act(spinning)
    momentum = 200.0 * CUBESAT.actuators.spin_inertia * np.ones(3)
    gyroscopic = np.cross([0.01, 0.0, 0.0], momentum)
    np.testing.assert_allclose(with_wheels[:, :3] - without[:, :3], np.tile(-gyroscopic, (3, 1)), atol=1e-12)


class TestAdaptive:
    """Control with the estimated inertia."""

    def law(self):
        task = load_task("point")
        return AdaptiveAttitude(CUBESAT, task, attitude_pd_gains(CUBESAT))

    def test_an_estimate_scales_the_torque(self):
        law = self.law()
        simulation = BatchSimulation(CUBESAT, law.task, STILL, worlds=1, seed=1)
        inputs = inputs_of(simulation)
        plain = law.act(inputs)
        law.reset()
        heavier = law.act(replace(inputs, readings={"inertia": 1.1 * CUBESAT.body.inertia_matrix}))
        np.testing.assert_allclose(heavier[:, :3], 1.1 * plain[:, :3], rtol=1e-9, atol=0)

    def test_an_estimate_strays_no_farther_than_its_bound(self):
        law = self.law()
        simulation = BatchSimulation(CUBESAT, law.task, STILL, worlds=1, seed=1)
        wild = replace(inputs_of(simulation), readings={"inertia": 50.0 * CUBESAT.body.inertia_matrix})
        np.testing.assert_allclose(law.inertia_of(wild), 1.3 * np.diag(CUBESAT.body.inertia))
        assert law.inertia_of(replace(wild, readings={})) is law.inertia


def test_a_task_that_moves_a_body_is_refused_for_a_satellite_and_the_other_way_round():
    with pytest.raises(
        ConfigError,
        match=r"'go_to_pose_3d' is for bodies that are pushed .*'cubesat_wheels' is one of the satellites",
    ):
        load_task("go_to_pose_3d").check(CUBESAT)
    with pytest.raises(
        ConfigError, match=r"'slew' is for satellites .*'spacecraft_16' is one of the bodies that are pushed"
    ):
        load_task("slew").check(load_robot("spacecraft_16"))
    with pytest.raises(ConfigError, match="'adaptive' is for satellites that only turn with reaction_wheels"):
        check_pair(load_robot("spacecraft_16"), load_task("go_to_pose_3d"), law="adaptive")


class TestSurroundings:
    """What scenarios do to satellites."""

    def test_sunlight_turns_the_body_about_an_axis_across_the_light(self):
        light = replace(STILL, solar=Solar(force=1e-4, arm=0.1))
        task = load_task("point_inertial")
        lit, dark = (
            BatchSimulation(CUBESAT, task, each, worlds=3, seed=1, dtype=np.float64)
            for each in (light, STILL)
        )
        for each in (lit, dark):
            for _ in range(20):
                each.move(np.zeros((3, 6)))
        turned = np.linalg.norm(np.array(lit.truth.rate) - np.array(dark.truth.rate), axis=0)
        assert (turned <= 1e-4 * 0.1 * 2.0 / 0.16 * 1.001).all()
        assert turned.max() > 1e-5

    def test_a_step_of_the_inertia_slows_what_a_torque_does(self):
        task = load_task("point_inertial")
        rates = []
        for change in (InertiaChange(), InertiaChange(step=0.5)):
            scenario = replace(STILL, inertia=change)
            simulation = BatchSimulation(CUBESAT, task, scenario, worlds=1, seed=1, dtype=np.float64)
            for _ in range(10):
                simulation.move(np.array([[0.005, 0.0, 0.0, 0.0, 0.0, 0.0]]))
            rates.append(float(simulation.truth.wx[0]))
        spin = CUBESAT.actuators.spin_inertia
        assert rates[0] / rates[1] == pytest.approx((1.5 * 0.26 - spin) / (0.26 - spin), rel=1e-6)

    def test_a_worse_or_dying_gyroscope_is_that_of_the_scenario(self):
        worse = sensors_in(CUBESAT, replace(STILL, sensing=Sensing(gyroscope=100.0, gyroscope_dies_s=3.0)))[
            "imu"
        ]
        assert worse.gyroscope.std == pytest.approx(1e-4)
        assert worse.gyroscope.walk == pytest.approx(1e-5)
        assert worse.dies_s == 3.0
        assert sensors_in(CUBESAT, STILL)["imu"] == CUBESAT.sensors.imu
