"""A robot's YAML, and what no robot can be."""

from __future__ import annotations

import pickle
from dataclasses import replace

import pytest

from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.config.paths import config_directory, config_names
from fulmar_core.robots.robot import Limits, Timing, Uncertainty
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.imu import ImuSpec
from fulmar_core.robots.sensors.odometer import Channel

ROBOT = load_robot("floating_platform")


@pytest.mark.parametrize(
    "change", [{"mass": 0.0}, {"radius": -1.0}, {"height": 0.0}, {"inertia": (0.1, 0.0, 0.1)}]
)
def test_a_body_without_mass_or_size_is_refused(change):
    with pytest.raises(ValueError, match="must be greater than 0"):
        replace(ROBOT.body, **change)


def test_a_moment_of_inertia_beyond_the_sum_of_the_others_is_refused():
    with pytest.raises(ValueError, match="no body has a moment beyond the sum"):
        replace(ROBOT.body, inertia=(0.1, 0.1, 0.5))


def test_a_flat_disc_is_a_body():
    assert replace(ROBOT.body, inertia=(0.1, 0.2, 0.3)).inertia == (0.1, 0.2, 0.3)


@pytest.mark.parametrize("name", ["floating_platform", "turtlebot2", "kingfisher"])
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"inertia": (0.1, 0.1, 0.1, 0.01, 0.0, 0.0)},
            "'body.inertia' has 6 values and 'body.center_of_mass' 2",
        ),
        ({"center_of_mass": (0.0, 0.0, 0.01)}, "'body.inertia' has 3 values and 'body.center_of_mass' 3"),
    ],
)
def test_a_robot_in_the_plane_has_no_mass_properties_of_space(name, change, words):
    robot = load_robot(name)
    with pytest.raises(ValueError, match=f"{words}; a robot on a floor or on water has xx, yy, zz and x, y"):
        replace(robot, body=replace(robot.body, **change))


@pytest.mark.parametrize("span", [(2.0, 1.0), (0.0, 1.0), (-1.0, 1.0)])
def test_an_empty_or_impossible_span_is_refused(span):
    with pytest.raises(ValueError, match="'mass' must be"):
        Uncertainty(span, (0.1, 0.2))
    with pytest.raises(ValueError, match="'yaw_inertia' must be"):
        Uncertainty((1.0, 2.0), span)


@pytest.mark.parametrize(("hz", "steps"), [(50.0, 1), (25.0, 2), (5.0, 10), (0.5, 100)])
def test_a_control_step_is_a_whole_number_of_physics_steps(hz, steps):
    assert Timing(0.02, 5.0).substeps(hz) == steps


@pytest.mark.parametrize("hz", [100.0, 7.0, 49.9, 51.0])
def test_a_rate_that_does_not_divide_the_physics_rate_is_refused(hz):
    with pytest.raises(ValueError, match="must divide the physics rate of 50 Hz evenly"):
        Timing(0.02, 5.0).substeps(hz)


@pytest.mark.parametrize("hz", [float("nan"), 0.0, -5.0])
def test_a_rate_that_is_no_rate_is_refused(hz):
    with pytest.raises(ValueError, match="control_hz"):
        Timing(0.02, 5.0).substeps(hz)


def test_limits_and_noises_have_to_mean_something():
    with pytest.raises(ValueError, match="greater than 0"):
        Limits(0.0, 1.0, 1.0)
    with pytest.raises(ValueError, match="must not be negative"):
        ImuSpec(rate_hz=-1.0)
    with pytest.raises(ValueError, match="must not be negative"):
        Channel(std=-0.1)
    with pytest.raises(ValueError, match="must not be negative"):
        replace(ROBOT.sensors.odometry, rate_hz=-1.0)


def test_a_machine_that_cannot_move_is_refused():
    with pytest.raises(ValueError, match="must be greater than 0"):
        replace(ROBOT, performance=replace(ROBOT.performance, speed=0.0))
    with pytest.raises(ValueError, match="must be greater than 0"):
        replace(ROBOT.performance, torque=0.0)
    with pytest.raises(ValueError, match="must not be negative"):
        replace(ROBOT.performance, lateral_speed=-0.1)


def test_a_body_whose_centre_of_mass_or_drag_is_impossible_is_refused():
    with pytest.raises(ValueError, match="'center_of_mass' must not be negative"):
        replace(ROBOT.uncertainty, center_of_mass=-0.1)
    with pytest.raises(ValueError, match="'drag' must be"):
        replace(ROBOT.uncertainty, drag=(1.1, 0.9))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("mass: [6.2, 6.8]", "mass: [3, 4]", r"mass: \[3, 4\], which does not hold the body's own 6.5"),
        (
            "[0.09, 0.115]",
            "[0.11, 0.12]",
            r"yaw_inertia: \[0.11, 0.12\], which does not hold the body's own 0.1018",
        ),
        ("[0.09, 0.115]", "[0.09, 0.5]", "no body has a moment beyond the sum of the two others, 0.293"),
    ],
)
def test_a_robot_that_is_never_drawn_or_cannot_exist_is_refused(tmp_path, monkeypatch, old, new, words):
    (tmp_path / "robots").mkdir()
    text = (config_directory() / "robots" / "turtlebot2.yaml").read_text()
    (tmp_path / "robots" / "turtlebot2.yaml").write_text(text.replace(old, new))
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    with pytest.raises(ConfigError, match=rf"robots/turtlebot2\.yaml: 'uncertainty' .*{words}"):
        load_robot("turtlebot2")


def test_the_span_of_a_whole_tensor_is_not_bound_by_the_nominal_moments(tmp_path, monkeypatch):
    (tmp_path / "robots").mkdir()
    text = (config_directory() / "robots" / "spacecraft_16.yaml").read_text()
    flat = text.replace("inertia: [0.2045, 0.2045, 0.2045]", "inertia: [0.1, 0.11, 0.2045]")
    assert flat != text
    (tmp_path / "robots" / "spacecraft_16.yaml").write_text(flat)
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    robot = load_robot("spacecraft_16")
    assert robot.uncertainty.yaw_inertia[1] > sum(robot.body.inertia[:2])


def test_wheels_outside_of_the_outline_are_refused():
    robot = load_robot("turtlebot2")
    with pytest.raises(ValueError, match="'track' = 23 m puts the wheels outside of the outline"):
        replace(robot, actuators=replace(robot.actuators, track=23.0))


def test_actuators_that_are_later_than_a_control_step_are_refused():
    platform = load_robot("floating_platform")
    late = replace(platform.actuators.response, delay_s=0.15, opening_delay_s=0.1)
    with pytest.raises(ValueError, match=r"add up to 0\.25 s; at most one control step, 0\.2 s"):
        replace(platform, actuators=replace(platform.actuators, response=late))


def test_wheels_do_not_swim():
    with pytest.raises(ValueError, match="exclude one another"):
        replace(load_robot("turtlebot2"), hydrodynamics=load_robot("kingfisher").hydrodynamics)


def test_an_unknown_robot_gets_the_nearest_name():
    with pytest.raises(UnknownNameError, match="Did you mean 'floating_platform'"):
        load_robot("floating_plattform")


def test_a_robot_whose_file_is_called_otherwise_is_refused(tmp_path, monkeypatch):
    (tmp_path / "robots").mkdir()
    text = (config_directory() / "robots" / "floating_platform.yaml").read_text()
    (tmp_path / "robots" / "other.yaml").write_text(text)
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    with pytest.raises(ConfigError, match="'name' is 'floating_platform', the file's own name is 'other'"):
        load_robot("other")


@pytest.mark.parametrize("name", config_names("robots"))
def test_a_robot_whose_sensors_were_asked_for_goes_to_another_process(name):
    robot = load_robot(name)
    assert robot.sensors.kinds
    there = pickle.loads(pickle.dumps(robot))
    assert there.name == name
    assert there.sensors.kinds == robot.sensors.kinds
