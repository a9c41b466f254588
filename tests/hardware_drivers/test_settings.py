"""Hardware files: those that are shipped, and mistakes in others."""

from __future__ import annotations

import pytest

from fulmar_core.errors import ConfigError
from fulmar_core.paths import config_names
from hardware_drivers.settings import hardware_of, load_hardware

TURTLEBOT = "title: t\nrobot: turtlebot2\ndriver:\n  kind: kobuki\n  port: /dev/ttyUSB0\n"


@pytest.mark.parametrize("name", config_names("hardware"))
def test_every_shipped_file_fits_its_robot(name):
    assert name in hardware_of(load_hardware(name).robot)


@pytest.mark.parametrize(
    ("robot", "first"),
    [("floating_platform", "zero_g_lab"), ("turtlebot2", "turtlebot2"), ("kingfisher", "kingfisher")],
)
def test_a_robot_s_own_file_comes_first(robot, first):
    assert hardware_of(robot)[0] == first


def test_the_asymmetry_of_a_boat_s_thrust_is_declared():
    thrust = load_hardware("kingfisher").driver.thrust
    assert (thrust.ahead, thrust.astern) == (45.0, 25.0)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("kobuki", "kobuky", r":4: 'kind' = 'kobuky' is not known. Did you mean 'kobuki'\?"),
        ("turtlebot2", "kingfisher", "driver 'kobuki' cannot move 'kingfisher', which has propellers"),
        ("turtlebot2", "turtlebot3", "unknown robot 'turtlebot3'. Did you mean 'turtlebot2'?"),
        ("/dev/ttyUSB0", "[1]", "'port' must be a single value"),
        ("  port", "  prot", ":5: unknown key 'prot'. Did you mean 'port'?"),
    ],
)
def test_a_mistake_is_told_with_its_place(tmp_path, old, new, says):
    path = tmp_path / "mine.yaml"
    path.write_text(TURTLEBOT.replace(old, new))
    with pytest.raises(ConfigError, match=says.replace("'?", r"'\?") if r"\?" not in says else says):
        load_hardware(str(path))


def test_too_few_valves_are_refused(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(
        "title: t\nrobot: floating_platform\ndriver: {kind: valve_topic, topic: /v, order: [1, 0]}\n"
    )
    with pytest.raises(ConfigError, match="'order' has 2 entries, the robot has 8 thrusters"):
        load_hardware(str(path))


VALVES = "title: t\nrobot: floating_platform\ndriver: {kind: valve_topic, topic: /v, order: ORDER, message: MESSAGE}\n"


@pytest.mark.parametrize(
    ("order", "thrusters"),
    [
        ("roboran", (5, 1, 3, 7, 0, 4, 6, 2)),
        ("rans", (2, 5, 4, 7, 6, 1, 0, 3)),
        ("[7, 6, 5, 4, 3, 2, 1, 0]", (7, 6, 5, 4, 3, 2, 1, 0)),
    ],
)
def test_an_order_of_valves_is_a_name_or_a_list(tmp_path, order, thrusters):
    path = tmp_path / "mine.yaml"
    path.write_text(VALVES.replace("ORDER", order).replace("MESSAGE", "byte"))
    driver = load_hardware(str(path)).driver
    assert (driver.order, driver.message) == (thrusters, "byte")


@pytest.mark.parametrize(
    ("order", "message", "says"),
    [
        ("robran", "int16", r":3: 'order' = 'robran' is not known. Did you mean 'roboran'\?"),
        ("rans", "int8", r"'message' = 'int8' is not known. Did you mean 'uint8'\?"),
        ("[0, 0, 1, 2, 3, 4, 5, 6]", "int16", "'order' must hold each of 0 to 7 once"),
    ],
)
def test_an_unknown_order_or_message_is_refused(tmp_path, order, message, says):
    path = tmp_path / "mine.yaml"
    path.write_text(VALVES.replace("ORDER", order).replace("MESSAGE", message))
    with pytest.raises(ConfigError, match=says):
        load_hardware(str(path))
