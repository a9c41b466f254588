"""Hardware files: those that are shipped, and mistakes in others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot_file import load_robot
from hardware_drivers.devices import UNPROTECTED, own_watchdog, when_the_driver_dies
from hardware_drivers.hardware import hardware_of, hardware_path, load_hardware

TURTLEBOT = "title: t\nrobot: turtlebot2\ndriver:\n  kind: kobuki\n  port: /dev/ttyUSB0\n"


@pytest.mark.parametrize("name", config_names("hardware"))
def test_every_shipped_file_fits_its_robot(name):
    assert name in hardware_of(load_hardware(name).robot)


RANS = (  # force and yaw moment of each wire, in the axes of `floating_platform` [N, N, N·m]
    (0.71, 0.71, -0.31), (0.71, -0.71, 0.31), (-0.71, 0.71, -0.31), (0.71, 0.71, 0.31),
    (-0.71, -0.71, -0.31), (-0.71, 0.71, 0.31), (0.71, -0.71, -0.31), (-0.71, -0.71, 0.31),
)  # fmt: skip
ROBORAN = (  # counter-clockwise and clockwise by turns, in pairs at 0°, 90°, 180° and 270°
    (0.0, 1.0, 0.31), (0.0, -1.0, -0.31), (-1.0, 0.0, 0.31), (1.0, 0.0, -0.31),
    (0.0, -1.0, 0.31), (0.0, 1.0, -0.31), (1.0, 0.0, 0.31), (-1.0, 0.0, -0.31),
)  # fmt: skip


@pytest.mark.parametrize(
    ("name", "robot", "wrenches"),
    [
        ("zero_g_lab", "floating_platform", RANS),
        ("zero_g_lab_valve_node", "floating_platform", RANS),
        ("zero_g_lab_roboran", "floating_platform_roboran", ROBORAN),
        ("zero_g_lab_roboran_valve_node", "floating_platform_roboran", ROBORAN),
    ],
)
def test_an_order_belongs_to_the_nozzles_of_its_robot(name, robot, wrenches):
    """Both sources wire the platform regularly: neighbouring wires push and turn against each other."""
    hardware = load_hardware(name)
    assert hardware.robot == robot
    found = load_robot(robot).actuators.wrench_per_newton[list(hardware.driver.order)][:, [0, 1, 5]]
    assert found == pytest.approx(np.array(wrenches), abs=0.01)
    assert (np.sign(found[:, 2]) == -np.sign(np.roll(found[:, 2], 1))).all()


@pytest.mark.parametrize(
    ("robot", "first"),
    [
        ("floating_platform", "zero_g_lab"),
        ("floating_platform_roboran", "zero_g_lab_roboran"),
        ("turtlebot2", "turtlebot2"),
        ("kingfisher", "kingfisher"),
    ],
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
def test_a_mistake_is_reported_with_its_place(tmp_path, old, new, says):
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


GPIO = "title: t\nrobot: ROBOT\ndriver: {kind: gpio_valves, port: x, lines: LINES, order: ORDER MORE}\n"
VALVE_TOPIC = "title: t\nrobot: ROBOT\ndriver: {kind: valve_topic, topic: /v, order: ORDER}\n"


def valves_file(folder: Path, text: str, robot: str, count: int, more: str = "") -> str:
    path = folder / "mine.yaml"
    lines = ", ".join(f"'{number}'" for number in range(count))
    order = ", ".join(map(str, range(count)))
    text = text.replace("ROBOT", robot).replace("LINES", f"[{lines}]").replace("ORDER", f"[{order}]")
    path.write_text(text.replace("MORE", more))
    return str(path)


def test_a_robot_in_space_has_as_many_valves_as_lines_and_no_bearing(tmp_path):
    hardware = load_hardware(valves_file(tmp_path, GPIO, "spacecraft_16", 16))
    assert (hardware.has_bearing, hardware.seen_from_outside, hardware.opens_valves) == (False, True, True)
    path = valves_file(tmp_path, GPIO, "spacecraft_16", 8)
    with pytest.raises(ConfigError, match="'order' has 8 entries, the robot has 16 thrusters"):
        load_hardware(path)


@pytest.mark.parametrize(("text", "more"), [(GPIO, ", bearing: {line: '99'}"), (VALVE_TOPIC, "")])
def test_a_driver_that_switches_an_air_bearing_is_refused_in_space(tmp_path, text, more):
    path = valves_file(tmp_path, text, "spacecraft_16", 16, more)
    with pytest.raises(ConfigError, match="'spacecraft_16' moves in space, and this driver switches an air"):
        load_hardware(path)


def test_a_robot_on_an_air_bearing_needs_the_line_of_its_valve(tmp_path):
    path = valves_file(tmp_path, GPIO, "floating_platform", 8)
    with pytest.raises(
        ConfigError, match="'floating_platform' floats on an air bearing: give 'driver' the line"
    ):
        load_hardware(path)


@pytest.mark.parametrize("name", config_names("hardware"))
def test_a_file_says_in_capitals_where_nothing_stops_the_device_when_the_driver_dies(name):
    driver = load_hardware(name).driver
    shouts = UNPROTECTED in hardware_path(name).read_text()
    assert shouts is (own_watchdog(driver) is None)
    assert when_the_driver_dies(driver).startswith(UNPROTECTED) is shouts


@pytest.mark.parametrize("wiring", ["[left, left]", "[left]", "[left, starboard]", "[-left, left]"])
def test_a_wiring_that_leaves_a_side_out_is_refused(tmp_path, wiring):
    path = tmp_path / "mine.yaml"
    path.write_text(f"{TURTLEBOT}  wiring: {wiring}\n")
    with pytest.raises(ConfigError, match="must name left and right once each"):
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
