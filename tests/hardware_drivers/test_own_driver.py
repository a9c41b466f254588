"""A driver of the user's own class: its wires, its settings, and whatever its methods do wrong."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError, DeviceError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.backend import AirBearing
from hardware_drivers.devices import make_device, when_the_driver_dies
from hardware_drivers.driver import MEMBERS, DeviceDriver
from hardware_drivers.driver_backend import STOPS
from hardware_drivers.hardware import hardware_of, load_hardware
from hardware_drivers.kingfisher_driver import KingfisherDriver
from hardware_drivers.kobuki_driver import KobukiDriver
from hardware_drivers.mavlink_driver import MavlinkDriver
from hardware_drivers.own_driver import check_own_driver
from hardware_drivers.presence import check_presence
from hardware_drivers.thruster_driver import ThrusterDriver
from hardware_drivers.topic_driver import TopicDriver, ValveTopicDriver
from tests.hardware_drivers.bench import episode_at, until
from tests.hardware_drivers.own_board import BOARD, PLATFORM, made, with_method, written

FLOATING = """
    bearing_on = False
    def set_bearing(self, on):
        self.bearing_on = on
        return ""
"""


@pytest.mark.parametrize(
    "driver",
    [KingfisherDriver, KobukiDriver, MavlinkDriver, ThrusterDriver, TopicDriver, ValveTopicDriver],
)
def test_every_shipped_driver_is_a_device_driver(driver):
    assert DeviceDriver in driver.__mro__
    assert not getattr(driver, "__abstractmethods__", None)
    assert all(callable(getattr(driver, member)) for member in MEMBERS)


def test_its_constructor_gets_robot_settings_and_options(folder):
    more = "  port: /dev/x\n  baud: 9600\n  options: {gain: 2.5, names: [a, 1, null], deep: {on: true}}\n"
    _, board = made(folder, more=more)
    assert (board.settings.port, board.settings.baud, board.patience_s) == ("/dev/x", 9600, 1.5)
    assert board.settings.options == {"gain": 2.5, "names": ["a", 1, None], "deep": {"on": True}}


def test_a_port_on_the_command_line_reaches_it(folder):
    hardware = load_hardware(written(folder, BOARD, more="  port: /dev/x\n"))
    device = make_device(load_robot(PLATFORM), hardware, port="/dev/y", patience_s=0.0)
    assert device._driver._driver.settings.port == "/dev/y"


def test_valves_are_handed_over_in_the_order_of_the_wires_and_come_back_in_the_robot_s(folder):
    more = "  order: [2, 5, 4, 7, 6, 1, 0, 3]\n"
    device, board = made(folder, BOARD.replace("tolist())", "tolist()); return command"), more=more)
    sample = device.step(np.eye(8)[5])
    assert board.sent[-1] == np.eye(8)[1].tolist()
    assert sample.applied.tolist() == np.eye(8)[5].tolist()


def test_without_an_order_channels_are_numbered_as_the_thrusters(folder):
    device, board = made(folder)
    device.step(np.eye(8)[5])
    assert board.sent[-1] == np.eye(8)[5].tolist()
    assert load_hardware(str(folder / "own.yaml")).driver.order == tuple(range(8))


@pytest.mark.parametrize(
    ("robot", "command", "sent"),
    [("kingfisher", (0.8, -0.3), (0.3, 0.8)), ("turtlebot2", (0.2, 0.0), (0.0, 2 * 0.2 / 0.23))],
)
def test_wheels_and_propellers_have_a_wiring(folder, robot, command, sent):
    """Crossed, and one of them backwards."""
    more = "  wiring: [-right, left]\n"
    device, board = made(folder, BOARD.replace("tolist())", "tolist()); return command"), robot, more)
    sample = device.step(np.array(command))
    assert board.sent[-1] == pytest.approx(sent)
    assert sample.applied == pytest.approx(command)


def test_what_the_class_does_to_its_command_does_not_reach_the_guard(folder):
    device, _ = made(folder, with_method("write(self, command)", "command[:] = 1.0"))
    command = np.zeros(8)
    assert not device.step(command).applied.any()
    assert not command.any()


def test_a_class_that_measures_returns_reports(folder):
    code = (
        with_method(
            "read(self)",
            "from tests.states import planar_state\n"
            "        from hardware_drivers.feedback import Report\n"
            "        return Report(planar_state(*self.place), None, 7)",
        )
        + "    def begin(self, *place):\n        self.place = place\n"
    )
    more = "  odometry: device\n"
    device, _ = made(folder, code, "kingfisher", more)
    sample = device.reset(episode_at(load_robot("kingfisher"), 1.0, -2.0, 0.5), seed=0)
    assert sample.odometry.position_in_world.tolist() == [1.0, -2.0, 0.0]
    assert float(sample.odometry.yaw) == pytest.approx(0.5)
    assert sample.stamp_ns == 7
    hardware = load_hardware(str(folder / "own.yaml"))
    assert hardware.measures_odometry and not hardware.seen_from_outside


WRONG = (
    ("write(self, command)", "{}['x']", r"write raised KeyError: 'x' \(.*own_board.py:14\)\.$"),
    ("write(self, command)", "raise SystemExit(3)", "write raised SystemExit: 3"),
    ("write(self, command)", "return [1.0, 2.0]", "write returned .* must be None or 8 finite numbers"),
    ("write(self, command)", "return command + np.nan", "write returned .* must be None or 8 finite numbers"),
    ("write(self, command)", "return 'sent'", "write raised ValueError: could not convert"),
    ("read(self)", "raise OSError('two\\nlines')", r"read raised OSError: two lines \(.*own_board.py:14\)"),
    ("read(self)", "return 3.0", "read returned float, which must be a Report or None"),
)


@pytest.mark.parametrize(("method", "body", "says"), WRONG)
def test_whatever_it_does_wrong_in_a_step_is_one_line_with_its_name(folder, method, body, says):
    device, _ = made(folder, with_method(method, body))
    with pytest.raises(DeviceError, match=rf"^driver 'own_board:Board': {says}") as caught:
        device.step(np.zeros(8))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("body", "says"),
    [
        ("1 / 0", "health raised ZeroDivisionError"),
        ("return 3", "health returned int, which must be a mapping"),
    ],
)
def test_health_that_fails_is_a_warning_and_no_end(folder, body, says):
    device, _ = made(folder, with_method("health(self)", body))
    assert says in device.health()["warning"]


def test_health_is_published_as_text(folder):
    device, _ = made(folder, with_method("health(self)", "return {'volts': 12.5}"))
    assert device.health() == {"volts": "12.5"}


FAILS_TWICE = (
    BOARD
    + """
    def write(self, command):
        self.sent.append(command.tolist())
        if len(self.sent) in (2, 3):
            raise OSError("noise on the line")
"""
)


def test_the_safe_command_is_tried_again_where_a_write_fails(folder):
    device, board = made(folder, FAILS_TWICE)
    device.step(np.ones(8))
    device.make_safe()
    assert len(board.sent) == 1 + STOPS
    assert not np.any(board.sent[1:])


def test_a_link_that_takes_no_safe_command_is_an_error_and_is_closed_all_the_same(folder):
    device, board = made(folder, with_method("write(self, command)", "raise OSError('gone')"))
    with pytest.raises(DeviceError, match="write raised OSError: gone"):
        device.close()
    assert board.closed == 1
    device.close()
    assert board.closed == 1


def test_it_is_stopped_before_it_is_closed(folder):
    device, board = made(folder)
    device.step(np.ones(8))
    device.close()
    assert board.sent[1:] == [[0.0] * 8] * STOPS
    assert board.closed == 1


HANGS = BOARD.replace("self.sent.append", "self.hold.wait(); self.sent.append").replace(
    "self.sent, self.closed", "import threading; self.hold = threading.Event(); self.sent, self.closed"
)


def test_a_write_that_hangs_is_an_error_is_never_entered_twice_and_the_device_is_closed(folder):
    device, board = made(folder, HANGS)
    hung = threading.Thread(target=device.step, args=(np.ones(8),))
    hung.start()
    with pytest.raises(DeviceError, match="has not finished a write: it hangs"):
        device.close()
    assert board.closed == 1
    assert board.sent == []
    board.hold.set()
    hung.join()
    assert board.sent == [[1.0] * 8]


def test_a_read_that_hangs_does_not_keep_the_safe_command_back(folder):
    code = HANGS.replace("self.hold.wait(); ", "") + "    def read(self):\n        self.hold.wait()\n"
    device, board = made(folder, code)
    hung = threading.Thread(target=device.step, args=(np.ones(8),))
    hung.start()
    until(lambda: bool(board.sent))
    device.make_safe()
    assert board.sent == [[1.0] * 8, *[[0.0] * 8] * STOPS]
    board.hold.set()
    hung.join()


def test_an_air_bearing_of_its_own_is_switched_and_holds_the_valves_closed_while_off(folder):
    device, board = made(folder, BOARD + FLOATING, more="  air_bearing: true\n")
    assert isinstance(device, AirBearing)
    assert not device.step(np.ones(8)).applied.any()
    assert device.set_bearing(True) == ""
    assert device.step(np.ones(8)).applied.all()
    assert board.bearing_on
    assert load_hardware(str(folder / "own.yaml")).has_bearing


@pytest.mark.parametrize(
    ("arm", "written_to"), [("", True), ("  arm: true\n", True), ("  arm: false\n", False)]
)
def test_a_device_that_may_not_be_armed_is_measured_and_never_written_to(folder, arm, written_to):
    device, board = made(folder, more=arm)
    assert device.step(np.ones(8)).applied.all() == written_to
    device.close()
    assert bool(board.sent) == written_to
    assert ("not armed" in device.health().get("warning", "")) != written_to


@pytest.mark.parametrize(
    ("sound", "broken", "refusal"),
    [
        ("self.bearing_on = on", "raise OSError('no air')", "set_bearing raised OSError: no air"),
        ("bearing_on = False", "@property\n    def bearing_on(self): 1 / 0", "AttributeError"),
    ],
)
def test_an_air_bearing_that_fails_keeps_the_valves_closed(folder, sound, broken, refusal):
    code = BOARD + FLOATING.replace(sound, broken, 1)
    device, _ = made(folder, code, more="  air_bearing: true\n")
    assert refusal in device.set_bearing(True)
    assert not device.bearing_on
    assert not device.step(np.ones(8)).applied.any()


def test_without_an_air_bearing_there_is_no_service_for_one(folder):
    assert not isinstance(made(folder)[0], AirBearing)


@pytest.mark.parametrize(
    ("code", "more", "says"),
    [
        (BOARD, "  air_bearing: true\n", "class 'Board' lacks bearing_on, set_bearing"),
        (BOARD + FLOATING, "", "switches an air bearing: write air_bearing: true into its hardware file"),
        ("class Board:\n    def write(self, command): pass\n", "", "lacks begin, read, health, close"),
        (BOARD.replace("def write", "def wrote"), "", "lacks write. Did you mean 'wrote'"),
        (BOARD.replace("Board", "Bort"), "", "has no class 'Board'. Did you mean 'Bort'"),
    ],
)
def test_a_class_that_does_not_fit_is_refused(folder, code, more, says):
    with pytest.raises(ConfigError, match=says):
        check_own_driver(load_hardware(written(folder, code, more=more)).driver)


def test_a_constructor_that_raises_is_a_mistake_of_configuration_and_an_absent_device_is_none(folder):
    with pytest.raises(ConfigError, match=r"raised KeyError: 'pins' \(.*own_board.py:\d+\)"):
        made(
            folder,
            BOARD.replace("self.sent, self.closed", "settings.options['pins']; self.sent, self.closed"),
        )


def test_an_absent_device_is_no_mistake_of_configuration(folder):
    code = BOARD.replace(
        "self.sent, self.closed",
        "from hardware_drivers.ports import open_port; open_port('/dev/ttyNONE', 9600, 0.0); self.sent, self.closed",
    )
    with pytest.raises(DeviceError, match="/dev/ttyNONE cannot be opened"):
        made(folder, code)


@pytest.mark.parametrize(
    ("robot", "driver", "says"),
    [
        (
            PLATFORM,
            "kind: own.Board",
            r":3: 'kind' = 'own.Board' is not known\..* Or name a class of your own",
        ),
        (PLATFORM, "kind: own board:Board", r":3: 'driver': 'own board:Board' names no class"),
        (PLATFORM, "kind: own:Board, order: [0, 1]", "'order' has 2 entries, the robot has 8 thrusters"),
        (PLATFORM, "kind: own:Board, order: [0, 0]", "'order' must hold each of 0 to 1 once"),
        (PLATFORM, "kind: own:Board, wiring: [right, left]", "'wiring' is for wheels and propellers"),
        ("kingfisher", "kind: own:Board, order: [0, 1]", "'order' is for thrusters"),
        ("kingfisher", "kind: own:Board, wiring: [left, left]", "must name left and right once each"),
        (PLATFORM, "kind: own:Board, device_timeout_s: -1", "device_timeout_s must not be negative"),
        (PLATFORM, "kind: own:Board, baud: 0", "baud = 0 must be greater than 0"),
        (PLATFORM, "kind: own:Board, odometry: gps", "'odometry' = 'gps' is not known"),
        (PLATFORM, "kind: own:Board, option: {}", "unknown key 'option'. Did you mean 'options'"),
        (PLATFORM, "kind: own:Board, options: [1]", "'options' must be a mapping"),
        (
            PLATFORM,
            "kind: own:Board, options: {a: 2020-01-01}",
            "'a' = 2020-01-01 is a date: .*, or quote it",
        ),
        (PLATFORM, "kind: own:Board, options: {a: {b: 1, b: 2}}", "key 'b' is written twice"),
    ],
)
def test_a_mistake_in_the_file_is_reported_with_its_place(tmp_path, robot, driver, says):
    path = tmp_path / "own.yaml"
    path.write_text(f"title: t\nrobot: {robot}\ndriver: {{{driver}}}\n")
    with pytest.raises(ConfigError, match=says):
        load_hardware(str(path))


def test_reading_a_file_imports_nothing(folder, monkeypatch):
    """As `fulmar list` does, and whoever reads the hardware file of a bag."""
    (folder / "hardware").mkdir()
    monkeypatch.setenv("FULMAR_CONFIGS", str(folder))
    text = "title: t\nrobot: jetbot\ndriver: {kind: 'own_not_there:Board'}\n"
    (folder / "hardware" / "mine.yaml").write_text(text)
    assert hardware_of("jetbot") == ["mine"]


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ("", "NOTHING BELOW THE DRIVER STOPS THE ACTUATORS WHEN IT DIES"),
        ("  device_timeout_s: 0.5\n", "if the driver dies, stopped within 0.5 s by the device"),
    ],
)
def test_what_stops_its_device_is_what_its_file_says(folder, more, says):
    assert when_the_driver_dies(load_hardware(written(folder, BOARD, more=more)).driver).startswith(says)


@pytest.mark.parametrize(
    ("port", "says"),
    [
        ("/dev/ttyNONE", "there is no such serial port"),
        ("/dev/gpiochip77", "there is no such GPIO chip"),
        ("tcp://127.0.0.1:1", "no connection within"),
    ],
)
def test_its_port_is_looked_for_before_a_run(folder, port, says):
    with pytest.raises(DeviceError, match=says):
        check_presence(load_hardware(written(folder, BOARD, more=f"  port: {port}\n")).driver)


@pytest.mark.parametrize("more", ["", "  port: udp://127.0.0.1:9\n"])
def test_a_class_that_opens_its_device_itself_is_not_looked_for(folder, more):
    check_presence(load_hardware(written(folder, BOARD, more=more)).driver)
