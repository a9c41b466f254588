"""What every row of the table of sensors promises, and how a robot's file names one."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest
import yaml

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_path
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.air_data import AirData, AirDataSpec
from fulmar_core.robots.sensors.fuel import fuel_of
from fulmar_core.robots.sensors.imu import Gyroscope, ImuSpec
from fulmar_core.robots.sensors.kind import Truth
from fulmar_core.robots.sensors.odometer import Channel
from fulmar_core.robots.sensors.simulated import SimulatedSensors
from fulmar_core.robots.sensors.star_tracker import StarTrackerSpec
from fulmar_core.robots.sensors.surfaces import SurfacePositions
from fulmar_core.robots.sensors.table import RANGES, SENSORS
from fulmar_core.robots.sensors.wheels import WheelSpeeds
from fulmar_core.robots.topics import WIRES
from fulmar_core.states.state import RigidBodyState

EACH = pytest.mark.parametrize("name", SENSORS)
TRUTH = Truth(
    RigidBodyState(np.zeros(3), np.array([0.0, 0.6, 0.0, 0.8]), np.zeros(3), np.array([0.1, 0.2, 0.3])),
    np.array([1.0, 2.0, 9.0]),
    {
        "wheels": WheelSpeeds(("wheel_x", "wheel_y"), np.array([10.0, -20.0])),
        "air_data": AirData(AirDataSpec.NAMES, np.array([28.0, 0.03, -0.01, 1.0])),
        "supply": 2.1e7,
        "fuel": fuel_of(0.7, 1.0),
        "surfaces": SurfacePositions(("elevator", "throttle"), np.array([0.1, 0.4])),
    },
)


@EACH
def test_its_part_of_the_yaml_has_a_default_for_every_key_and_a_wire(name):
    kind = SENSORS[name]
    assert is_dataclass(kind.spec)
    assert hash(kind.spec()) == hash(kind.spec())
    assert kind.wire in WIRES
    assert kind.wire.source == "plant"


@EACH
def test_its_ranges_are_of_its_own_keys(name):
    keys = {row.key.split(".")[2] for row in RANGES if row.key.startswith(f"sensors.{name}.")}
    assert keys <= {field.name for field in fields(SENSORS[name].spec)}


@pytest.mark.parametrize("name", [name for name, kind in SENSORS.items() if kind.simulate])
def test_a_simulated_reading_survives_its_message(name):
    kind = SENSORS[name]
    sensors = SimulatedSensors({name: kind.spec()}, noisy=True)
    sensors.reset(1, 0)
    reading = sensors.measure(TRUTH, 0.0)[name]
    values = kind.message.write(reading, kind.spec())
    assert len(values) == len(kind.message.paths)
    again = kind.message.write(kind.message.read(values), kind.spec())
    for one, other in zip(values, again, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.fixture
def own(tmp_path, monkeypatch):
    """Loads turtlebot2 with other sensors."""

    def load(sensors):
        robot = yaml.safe_load(config_path("robots", "turtlebot2").read_text(encoding="utf-8"))
        robot["sensors"] |= sensors
        path = tmp_path / "robots" / "mybot.yaml"
        path.write_text(yaml.safe_dump(robot | {"name": "mybot"}), encoding="utf-8")
        return load_robot("mybot")

    (tmp_path / "robots").mkdir()
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    return load


def test_a_robot_has_the_sensors_that_its_file_names(own):
    assert list(own({}).sensors.specs) == ["odometry", "imu"]
    robot = own({"star_tracker": {"std": 1e-4, "rate_hz": 1, "boresight": [1, 0, 0]}})
    assert list(robot.sensors.specs) == ["odometry", "imu", "star_tracker"]
    assert robot.sensors.specs["star_tracker"] == StarTrackerSpec(
        std=1e-4, rate_hz=1.0, boresight=(1.0, 0.0, 0.0)
    )
    assert replace(robot, title="other").sensors == robot.sensors
    assert hash(robot) == hash(replace(robot))


@pytest.mark.parametrize(
    ("sensors", "says"),
    [
        ({"star_traker": {}}, r"unknown key 'star_traker'\. Did you mean 'star_tracker'\?"),
        ({"star_tracker": {"rate": 1}}, r"unknown key 'rate'\. Did you mean 'rate_hz'\?"),
        ({"star_tracker": None}, "'star_tracker' must be a mapping"),
        ({"star_tracker": {"dropout": 2}}, r"'star_tracker': 'dropout' = 2 must lie in"),
        (
            {"star_tracker": {"boresight_std": 20}},
            r"'sensors.star_tracker.boresight_std' = 20 rad is not plaus",
        ),
    ],
)
def test_a_mistake_in_a_sensor_is_one_line_with_its_place(own, sensors, says):
    with pytest.raises(ConfigError, match=rf"mybot\.yaml:\d+: .*{says}") as caught:
        own(sensors)
    assert "\n" not in str(caught.value)


def test_sensors_draw_from_streams_of_their_own():
    """What one sensor draws changes nothing of another."""
    specs = {"imu": ImuSpec(Channel(std=0.1), Gyroscope(std=0.1)), "star_tracker": StarTrackerSpec(std=0.01)}

    def readings_of(**more):
        sensors = SimulatedSensors({**specs, **more}, noisy=True)
        sensors.reset(3, 1)
        return [sensors.measure(TRUTH, 0.1 * k) for k in range(10)]

    many = readings_of(star_tracker=StarTrackerSpec(std=0.02, bias_std=0.1, dropout=0.5))
    few = readings_of()
    for one, other in zip(many, few, strict=True):
        np.testing.assert_array_equal(one["imu"].value.specific_force, other["imu"].value.specific_force)
