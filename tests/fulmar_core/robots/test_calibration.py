"""Calibration: values measured on one robot take the place of those in its YAML."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.dynamics.motion import may_be_off_centre
from fulmar_core.robots.calibration import (
    VARIABLE,
    Calibration,
    Measured,
    calibrated,
    load_calibration,
    save_calibration,
)
from fulmar_core.robots.robot_file import load_robot, use_calibration
from fulmar_core.states.counter_rng import WORLD, Draws
from fulmar_core.worlds.scenario import draw_world, load_scenario, longest_delay


def near(value, width=0.01):
    return Measured(value, round(value - width, 6), round(value + width, 6))


PLATFORM = Calibration(
    "floating_platform",
    runs=("runs/bare",),
    mass=Measured(5.0, 4.9, 5.1),
    yaw_inertia=Measured(0.15, 0.14, 0.16),
    center_of_mass_x=near(0.01, 0.003),
    center_of_mass_y=near(-0.02, 0.004),
    thrust=near(0.8),
    delay=near(0.04),
    opening_delay=near(-0.001),
)
WHEELS = Calibration(
    "turtlebot2", wheel_scale=near(1.02), turn_scale=near(0.97), lag=near(0.12), delay=near(0.02)
)


@pytest.fixture
def nobody(monkeypatch):
    """No calibration before, and none after."""
    monkeypatch.setenv(VARIABLE, "")


def worlds(robot, scenario):
    return draw_world(robot, load_scenario(scenario), Draws(0, np.arange(50), np.zeros(50), WORLD))


def test_a_file_says_what_was_saved(tmp_path):
    save_calibration(PLATFORM, tmp_path / "deep" / "c.yaml")
    assert load_calibration(tmp_path / "deep" / "c.yaml") == PLATFORM


def test_body_thrust_and_delays_are_those_that_were_measured():
    nominal = load_robot("floating_platform")
    robot = calibrated(nominal, PLATFORM)
    assert robot.body.mass == 5.0
    assert robot.body.inertia == pytest.approx((0.15, 0.15, 0.15))
    assert robot.body.center_of_mass == (0.01, -0.02)
    assert robot.actuators.thrust == 0.8
    assert robot.performance.force == pytest.approx(0.8 * nominal.performance.force)
    assert robot.actuators.response.delay_s == 0.04
    assert robot.actuators.response.opening_delay_s == 0.0  # noise put it below nothing
    assert robot.sensors == nominal.sensors


def test_scenarios_draw_from_the_measured_intervals():
    robot = calibrated(load_robot("floating_platform"), PLATFORM)
    uncertain, nominal = worlds(robot, "uncertain"), worlds(robot, "nominal")
    assert 4.9 <= uncertain.mass.min() < uncertain.mass.max() <= 5.1
    assert np.hypot(uncertain.com_x - 0.01, uncertain.com_y + 0.02).max() <= 0.005 + 1e-6
    assert (nominal.com_x == np.float32(0.01)).all() or np.allclose(nominal.com_x, 0.01)
    assert may_be_off_centre(robot, load_scenario("nominal"))
    assert longest_delay(robot, load_scenario("nominal")) == pytest.approx(0.04)


def test_wheels_go_as_far_as_they_were_measured_to():
    robot = calibrated(load_robot("turtlebot2"), WHEELS)
    assert robot.actuators.response.lag_s == 0.12
    np.testing.assert_allclose(worlds(robot, "nominal").gain, [[1.02] * 50, [0.97] * 50], rtol=1e-6)


def test_drag_of_nothing_is_not_negative():
    drag = {"surge_linear_drag": Measured(-0.2, -1.0, 0.6), "surge_quadratic_drag": near(20.0)}
    water = calibrated(load_robot("kingfisher"), Calibration("kingfisher", **drag)).hydrodynamics
    assert (water.linear_damping[0], water.quadratic_damping[0]) == (0.0, 20.0)
    assert water.linear_damping[1] == load_robot("kingfisher").hydrodynamics.linear_damping[1]


def test_it_is_in_use_wherever_the_robot_is_loaded_and_nowhere_else(tmp_path, nobody):
    save_calibration(PLATFORM, tmp_path / "c.yaml")
    use_calibration(tmp_path / "c.yaml", "floating_platform")
    assert load_robot("floating_platform").body.mass == 5.0
    assert load_robot("turtlebot2").actuators.response.gain == ()


def test_no_file_changes_nothing(nobody):
    use_calibration(None, "floating_platform")
    assert load_robot("floating_platform").body.mass == 5.32


@pytest.mark.parametrize(
    ("calibration", "robot", "message"),
    [
        (PLATFORM, "turtlebot2", "is for 'floating_platform', not for 'turtlebot2'"),
        (
            replace(PLATFORM, wheel_scale=near(1.0)),
            "floating_platform",
            "'wheel_scale' is nothing that this robot has",
        ),
        (replace(PLATFORM, mass=Measured(-1.0, -2.0, 0.5)), "floating_platform", "must be greater than 0"),
        (replace(PLATFORM, center_of_mass_x=near(0.5)), "floating_platform", "lies outside of the outline"),
    ],
)
def test_a_file_that_does_not_fit_is_refused_in_words(tmp_path, nobody, calibration, robot, message):
    save_calibration(calibration, tmp_path / "c.yaml")
    with pytest.raises(ConfigError, match=message):
        use_calibration(tmp_path / "c.yaml", robot)
    assert load_robot("floating_platform").body.mass == 5.32


def test_a_mistake_in_a_file_is_reported_with_its_line(tmp_path, nobody):
    (tmp_path / "c.yaml").write_text("robot: floating_platform\nmas: {value: 5, low: 4, high: 6}\n")
    with pytest.raises(ConfigError, match=r"c\.yaml:2: unknown key 'mas'\. Did you mean 'mass'"):
        use_calibration(tmp_path / "c.yaml", "floating_platform")
