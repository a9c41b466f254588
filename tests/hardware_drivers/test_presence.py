"""A missing device is reported before anything starts: what is missing, what exists, what to do."""

from __future__ import annotations

import socket
import time
from dataclasses import replace

import gpiod
import pytest

from fulmar_core.config.errors import ConfigError, DeviceError
from hardware_drivers.hardware import load_hardware
from hardware_drivers.presence import check_presence
from hardware_drivers.settings import Kobuki

VALVES = load_hardware("zero_g_lab").driver
BOAT = load_hardware("kingfisher").driver


@pytest.fixture(autouse=True)
def at_once():
    began = time.monotonic()
    yield
    assert time.monotonic() - began < 1.0


def test_an_absent_serial_port_is_reported_with_those_that_exist(monkeypatch):
    class Port:
        device, description = "/dev/ttyACM7", "CP2102"

    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [Port])
    with pytest.raises(
        DeviceError, match=r"/dev/ttyNONE: there is no such serial port\..*/dev/ttyACM7 \(CP2102\)"
    ):
        check_presence(Kobuki("kobuki", "/dev/ttyNONE"))


def test_a_port_on_the_command_line_counts_and_not_the_file_s(tmp_path):
    (tmp_path / "port").touch()
    check_presence(Kobuki("kobuki", "/dev/ttyNONE"), str(tmp_path / "port"))


def test_a_port_that_this_user_may_not_use_is_reported_with_the_group(tmp_path, monkeypatch):
    (tmp_path / "port").touch()
    monkeypatch.setattr("os.access", lambda *_: False)
    with pytest.raises(DeviceError, match=r"may not use the port.*dialout"):
        check_presence(Kobuki("kobuki", str(tmp_path / "port")))


def test_an_absent_chip_is_reported(tmp_path):
    with pytest.raises(DeviceError, match=r"/dev/gpiochip77: there is no such GPIO chip\. GPIO chips here:"):
        check_presence(VALVES, "/dev/gpiochip77")
    with pytest.raises(DeviceError, match="no such file of levels"):
        check_presence(VALVES, f"file://{tmp_path / 'none'}")


def test_a_chip_of_another_board_is_reported_with_the_lines_that_it_lacks(tmp_path, monkeypatch):
    class Chip:
        def __init__(self, _address):
            pass

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

        def line_offset_from_id(self, line):
            if line in ("PZ.06", "PAC.06"):
                raise OSError("no such line")

    monkeypatch.setattr(gpiod, "Chip", Chip)
    (tmp_path / "chip").touch()
    with pytest.raises(DeviceError, match=r"the chip has no line PZ\.06, PAC\.06\. Is this the right board"):
        check_presence(VALVES, str(tmp_path / "chip"))


def test_a_host_that_accepts_no_connection_is_reported():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with pytest.raises(DeviceError, match=r"no connection within 0\.7 s.*Is the device on"):
        check_presence(replace(BOAT, port=f"tcp://127.0.0.1:{port}"))
    with socket.create_server(("127.0.0.1", port)):
        check_presence(replace(BOAT, port=f"tcp://127.0.0.1:{port}"))


@pytest.mark.parametrize("name", ["kingfisher_ardupilot", "zero_g_lab_valve_node", "kingfisher_action"])
def test_what_only_a_message_shows_is_not_looked_for(name):
    check_presence(load_hardware(name).driver)


def test_a_driver_whose_messages_are_not_installed_says_what_installs_them(monkeypatch):
    monkeypatch.setattr("hardware_drivers.presence.find_spec", lambda _name: None)
    words = "driver 'px4_thrusters' needs px4_msgs, which is not installed. Run: fulmar install-px4"
    with pytest.raises(ConfigError, match=words):
        check_presence(load_hardware("modular_freeflyer_px4").driver)
