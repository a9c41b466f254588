"""Mistakes of unit in configuration files are refused, unusual values are a warning, and shipped files have neither."""

from __future__ import annotations

import logging

import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_directory, config_names
from fulmar_core.config.plausible_ranges import ROBOT, SCENARIO, TASK
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.geofence import check_starts
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario

LOADERS = {"robots": load_robot, "tasks": load_task, "scenarios": load_scenario}
FILES = [(family, name) for family in LOADERS for name in config_names(family)]
PLATFORM, POSE = "robots/floating_platform", "tasks/go_to_pose"


@pytest.fixture
def load(tmp_path, monkeypatch):
    """Load a shipped file in which some texts are others."""

    def changed(file, *changes):
        family, name = file.split("/")
        path = tmp_path / f"{file}.yaml"
        text = (config_directory() / f"{file}.yaml").read_text()
        for old, new in changes:
            assert text.count(old) >= 1, old
            text = text.replace(old, new, 1)
        path.parent.mkdir()
        path.write_text(text)
        monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
        return LOADERS[family](name)

    return changed


@pytest.mark.parametrize(("family", "name"), FILES, ids=lambda value: value)
def test_shipped_files_have_usual_values(family, name, caplog):
    with caplog.at_level(logging.WARNING, logger="fulmar_core"):
        LOADERS[family](name)
    assert caplog.messages == []


@pytest.mark.parametrize(
    ("file", "change", "words"),
    [
        (PLATFORM, ("radius: 0.31", "radius: 310"), r":12: 'body.radius' = 310 m .*0.03 to 6 m.*310 mm are 0.31 m"),
        (PLATFORM, ("thrust: 1.0", "thrust: 1000.0"), r"'actuators.thrust' = 1000 N .*1000 mN are 1 N"),
        (
            PLATFORM,
            ("heading: {std: 0.002}", "heading: {std: 2.0}"),
            r"'sensors.odometry.heading.std' = 2 rad .*0 to 0.2 rad.*2 ° are 0.03491 rad",
        ),
        (
            PLATFORM,
            ("thruster_3, position: [-0.2192031, 0.2192031", "thruster_3, position: [-0.45, 0.2192031"),
            r":41: 'actuators.nozzles.2.position' = \[-0.45, 0.2192031, 0.0\], 0.5005 m .*0 to 0.341 m .*to 0.403 m\.$",
        ),
        (
            PLATFORM,
            ("inertia: [0.2045, 0.2045, 0.2045]", "inertia: [0.2045, 0.2045, 0.00204]"),
            r"'body.inertia.2' = 0.00204 kg·m² .*0.02556 to 0.5368 kg·m²",
        ),
        (PLATFORM, ("yaw_rate: 6.0", "yaw_rate: 360.0"), r"'limits.yaw_rate' = 360 rad/s .*360 °/s are 6.283 rad/s"),
        ("robots/turtlebot2", ("wheel_radius: 0.035", "wheel_radius: 35"), r"'actuators.wheel_radius' = 35 m .*35 mm"),
        ("robots/kingfisher", ("water_density: 997.0", "water_density: 0.997"), r"0.997 g/cm³ are 997 kg/m³"),
        ("robots/kingfisher", ("draught: 0.1064", "draught: 1.064"), r"'hydrodynamics.hydrostatics.draught'"),
        ("robots/kingfisher", ("position: [-0.53, 0.37765", "position: [-53, 0.37765"), r"'actuators.propellers.0"),
        (POSE, ("position: 0.1", "position: 100"), r"'tolerance.position' = 100 m .*100 mm are 0.1 m"),
        (POSE, ("hold_s: 4.0", "hold_s: 4000"), r"'tolerance.hold_s' = 4000 s .*4000 ms are 4 s"),
        ("tasks/push_block", ("mass: 0.1", "mass: 1e5"), r"'block.mass' = 100000 kg"),
        ("scenarios/drift_force_2", ("force: 0.2", "force: 20"), r"'push.force' = 20 of 1 .*20 % are 0.2 of 1"),
        (
            "scenarios/drift_velocity_noise_2",
            ("velocity_noise: [0.02, 0.02]", "velocity_noise: [0.02, 20]"),
            r"'sensing.velocity_noise.1' = 20 m/s .*20 mm/s are 0.02 m/s",
        ),
    ],
    ids=lambda value: value[1] if isinstance(value, tuple) else "",
)  # fmt: skip
def test_a_mistake_of_unit_is_refused_with_key_value_range_and_unit(load, file, change, words):
    with pytest.raises(ConfigError, match=words):
        load(file, change)


@pytest.mark.parametrize(
    ("file", "change", "words"),
    [
        (PLATFORM, ("thrust: 1.0", "thrust: 40.0"), "'actuators.thrust' = 40 N is unusual; usual is 0.000532 to 26.6"),
        (PLATFORM, ("geofence: 8.0", "geofence: 20000"), "'limits.geofence' = 20000 m is unusual"),
        (POSE, ("heading_deg: 10.0", "heading_deg: 0.17"), "0.17 rad are 9.74 °"),
        ("scenarios/lab_mocap", ("delay_s: 0.2", "delay_s: 2"), "'sensing.delay_s' = 2 s is unusual"),
    ],
    ids=lambda value: value[1] if isinstance(value, tuple) else "",
)  # fmt: skip
def test_an_unusual_value_loads_with_a_warning(load, caplog, file, change, words):
    with caplog.at_level(logging.WARNING, logger="fulmar_core"):
        load(file, change)
    (message,) = caplog.messages
    assert words in message


def test_a_geofence_smaller_than_the_starts_of_a_task_is_refused(load):
    robot = load(PLATFORM, ("geofence: 8.0", "geofence: 4.5"))
    with pytest.raises(
        ConfigError, match=r"'limits.geofence' = 4.5 m .* up to 5 m from the goal \('start.distance'\)"
    ):
        check_starts(robot, load_task("go_to_pose"))
    with pytest.raises(ConfigError, match="'start_distance'"):
        check_starts(robot, load_task("go_through_positions"))
    check_starts(robot, load_task("drift_go_to_pose"))
    check_starts(robot, load_task("track_velocities"))


@pytest.mark.parametrize("row", (*ROBOT, *SCENARIO, *TASK), ids=lambda row: row.key)
def test_a_usual_value_is_a_possible_one_and_each_range_has_a_reason(row):
    assert row.possible[0] <= row.usual[0] < row.usual[1] <= row.possible[1]
    assert row.why
