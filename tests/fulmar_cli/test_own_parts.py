"""Controllers and sensors of the user's own: a mistake in the class is one line, before anything starts."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_core.config.errors import BAD_USAGE, ConfigError, DeviceError
from fulmar_core.config.paths import OWN_FOLDERS
from fulmar_core.robots.robot_file import load_robot
from fulmar_ros.message_class import needed_class
from tests.fulmar_cli.command_line import complaint
from tests.own_files import own_folder, write_sentry

CONTROLLER = """
class Short:
    def __init__(self, robot, task, settings): pass
    def reset(self): pass
    def act(self, inputs): pass
class Lacks:
    def __init__(self, robot, task, settings): pass
    def reset(self): pass
"""
RUN = ("run", "--task", "go_to_position", "--lockstep", "--record", "bag", "--json")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    with own_folder(tmp_path, monkeypatch):
        yield tmp_path


@pytest.fixture
def sensor(folder, monkeypatch):
    """Function that changes the sensor of the page."""
    monkeypatch.setenv(OWN_FOLDERS, write_sentry(folder))

    def change(old, new):
        file = folder / "my_sensor.py"
        assert old in file.read_text()
        file.write_text(file.read_text().replace(old, new))

    return change


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("wrong:Shart", "has no class 'Shart'. Did you mean 'Short'?"),
        ("wrong:Lacks", "class 'Lacks' lacks act"),
        ("wrung:Short", "there is no module 'wrung'"),
    ],
)
def test_a_controller_that_is_not_there_or_lacks_a_method_is_one_line(name, words, fulmar, folder):
    (folder / "wrong.py").write_text(CONTROLLER)
    assert words in complaint(fulmar(*RUN, "turtlebot2", "--controller", name))
    assert not (folder / "bag").exists()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("class WallRange", "class WallRanger", "has no class 'WallRange'. Did you mean 'WallRanger'?"),
        ("fields =", "columns =", "lacks fields"),
        ("sensor_msgs/msg/Range", "Range", "message 'Range' names no type"),
    ],
)
def test_a_mistake_in_the_class_of_a_sensor_is_one_line(old, new, words, fulmar, folder, sensor):
    sensor(old, new)
    code, _, err = fulmar(*RUN, "sentry", "--controller", "my_control:KeepOff")
    assert code == BAD_USAGE
    assert words in err.splitlines()[-1]
    assert not (folder / "bag").exists()


def test_a_message_that_is_not_installed_is_named_with_its_package(sensor):
    sensor("sensor_msgs/msg/Range", "sensor_msgs/msg/Ranges")
    wire = load_robot("sentry").sensors.kinds["front"].wire
    with pytest.raises(ConfigError, match=r"no message type sensor_msgs/msg/Ranges here\. .* 'sensor_msgs'"):
        needed_class(wire)


def test_a_sensor_that_raises_while_it_measures_is_one_line(sensor):
    sensor("return float", "return 1.0 / 0.0, float")
    sensors = load_robot("sentry").sensors
    body = SimpleNamespace(quat_xyzw=np.array([0.0, 0.0, 0.0, 1.0]), position_in_world=np.zeros(3))
    simulated = sensors.kinds["front"].simulate(sensors.own["front"], False)
    simulated.reset(0, 0)
    with pytest.raises(DeviceError, match="measure raised ZeroDivisionError: "):
        simulated.measure(SimpleNamespace(state=body), 0.0)
