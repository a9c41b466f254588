"""A scenario is for the robots on which it acts, and for no other."""

from __future__ import annotations

import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names
from fulmar_core.robots.kinds import KINDS
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.worlds.by_kind import ACTING, check_scenario, without_effect
from fulmar_core.worlds.scenario import load_scenario


def test_every_kind_of_robot_has_its_disturbances():
    assert ACTING.keys() == KINDS.keys()


@pytest.mark.parametrize(
    ("robot", "scenario", "lost"),
    [
        ("floating_platform", "gyro_dies", "orbit_rate, solar, gyroscope"),
        ("spacecraft_16", "gyro_dies", "solar, gyroscope"),
        ("navion", "low_orbit", "orbit_rate"),
        ("turtlebot2", "light_turbulence", "air"),
        ("spacecraft_16", "lab_slope", "slope"),
        ("int_ball2", "lab_tether", "tether"),
        ("int_ball2", "drift_floor_wave", "wave"),
        ("cubesat_wheels", "drift_force_2", "push.force"),
        ("cubesat_wheels", "lab_mocap", "odometry"),
        ("jetbot", "lab_valves", "valves"),
        ("jetbot", "tank_low", "tank"),
        ("kingfisher", "bearing_late", "bearing"),
        ("kingfisher", "wheel_dead", "stuck"),
        ("floating_platform", "surface_stuck", "stuck"),
    ],
)
def test_what_would_have_no_effect_is_refused_with_what_has(robot, scenario, lost):
    with pytest.raises(ConfigError, match=f"scenario '{scenario}'.*: {lost} would have no effect") as caught:
        check_scenario(load_robot(robot), scenario)
    fitting = str(caught.value).partition("Scenarios that fit: ")[2].rstrip(".").split(", ")
    assert {"nominal", "randomised", "one_dead"} <= set(fitting)
    assert scenario not in fitting


@pytest.mark.parametrize(
    ("robot", "scenario"),
    [
        ("cubesat_wheels", "gyro_dies"),
        ("cubesat_wheels", "wheel_dead"),
        ("spacecraft_16", "tank_low"),
        ("navion", "severe_turbulence"),
        ("kingfisher", "propeller_lost"),
        ("floating_platform", "bearing_late"),
        ("jetbot", "wheel_dead"),
    ],
)
def test_what_acts_is_taken(robot, scenario):
    check_scenario(load_robot(robot), scenario)


def test_a_gyroscope_that_an_estimator_reads_may_die():
    gyro = load_scenario("gyro_dies")
    platform = load_robot("floating_platform")
    assert "gyroscope" not in without_effect(platform, gyro, estimated=True)
    assert "gyroscope" in without_effect(platform, gyro)


def test_every_scenario_that_is_shipped_acts_on_some_robot():
    robots = [load_robot(kind.usual_robot) for kind in KINDS.values()] + [load_robot("cubesat_8")]
    for name in config_names("scenarios"):
        assert any(not without_effect(robot, load_scenario(name)) for robot in robots), name


def test_a_broken_file_of_ones_own_does_not_hide_why_a_scenario_is_refused(tmp_path, monkeypatch):
    folder = tmp_path / "scenarios"
    folder.mkdir()
    (folder / "broken.yaml").write_text("title: broken\npush: {forces: 1}\n")
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    with pytest.raises(ConfigError, match="orbit_rate would have no effect") as caught:
        check_scenario(load_robot("navion"), "low_orbit")
    assert "broken" not in str(caught.value)


def test_a_new_kind_of_robot_meets_what_acts_on_bodies_in_space(monkeypatch):
    monkeypatch.delitem(ACTING, "aircraft")
    new = load_robot("navion")
    assert not without_effect(new, load_scenario("low_orbit"))
    assert "air" in without_effect(new, load_scenario("light_turbulence"))
