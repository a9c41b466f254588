"""Commands and a driver of the user's own: what they say of it, and of every mistake in it, before anything starts."""

from __future__ import annotations

import json

import pytest

from fulmar_bringup.commissioning.hardware_file import wires_of
from fulmar_bringup.launched_system import list_nodes
from fulmar_cli.diagnosis.devices import diagnose_hardware
from fulmar_core.config.errors import ConfigError
from hardware_drivers.hardware import load_hardware
from tests.fulmar_cli.command_line import RUN, complaint
from tests.own_files import own_folder

BOARD = """
from hardware_drivers.driver import DeviceDriver
class Board(DeviceDriver):
    def __init__(self, robot, settings, *, patience_s): raise AssertionError("nothing is built before a run")
    def write(self, command): pass
    def close(self): pass
"""
FILE = "title: own board\nrobot: floating_platform\ndriver:\n  kind: own_board:Board\n"
ON_HARDWARE = [*RUN, "--backend", "hardware", "--hardware", "own.yaml", "--goal", "1,0,0"]
LACKING = BOARD.replace("def write", "def send")
MISTAKES = [
    (LACKING, "driver 'own_board:Board': ", "class 'Board' lacks write."),
    (BOARD.replace("Board", "Bort"), "has no class 'Board'. ", "Did you mean 'Bort'?"),
    (BOARD + "1 / 0\n", "driver: module 'own_board' cannot be imported: ", "own_board.py:7)."),
    (None, "driver: there is no module 'own_board' in ", "Did you mean 'own_boarb'?"),
]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    with own_folder(tmp_path, monkeypatch):
        (tmp_path / "own.yaml").write_text(FILE)
        (tmp_path / "own_boarb.py").touch()
        yield tmp_path


@pytest.mark.parametrize(
    ("command", "code", "begins", "ends"),
    [(ON_HARDWARE, *mistake) for mistake in MISTAKES] + [(["commission", "own.yaml"], *MISTAKES[0])],
)
def test_a_class_that_cannot_be_used_gets_one_line_and_exit_code_2(
    folder, fulmar, command, code, begins, ends
):
    if code is not None:
        (folder / "own_board.py").write_text(code)
    line = complaint(fulmar(*command))
    assert begins in line
    assert ends in line
    assert not (folder / "runs").exists()


def test_the_launch_file_refuses_it_as_well(folder):
    (folder / "own_board.py").write_text(LACKING)
    with pytest.raises(ConfigError, match="class 'Board' lacks write"):
        list_nodes(backend="hardware", hardware="own.yaml")


def test_nodes_get_the_file_with_its_whole_path(folder):
    (folder / "own_board.py").write_text(BOARD)
    plant = next(node for node in list_nodes(backend="hardware", hardware="own.yaml") if node.name == "plant")
    assert plant.module == "hardware_drivers.driver_node"
    assert plant.parameters["hardware"] == str(folder / "own.yaml")


@pytest.mark.parametrize("command", [[*ON_HARDWARE, "--emulate"], ["commission", "own.yaml", "--emulate"]])
def test_no_emulator_speaks_for_it(folder, fulmar, command):
    (folder / "own_board.py").write_text(BOARD)
    assert "no emulator exists for the device of your own driver 'own_board:Board'" in complaint(
        fulmar(*command)
    )


@pytest.mark.parametrize("command", [ON_HARDWARE, ["commission", "own.yaml"]])
def test_a_device_that_is_armed_moves_only_when_a_person_allows_it(folder, fulmar, command):
    (folder / "own_board.py").write_text(BOARD)
    assert "--arm is for autopilots" in complaint(fulmar(*command, "--arm"))
    (folder / "own.yaml").write_text(FILE + "  arm: false\n")
    assert "not armed: arm: true or --arm. Driving arms the device. Write arm: true" in complaint(
        fulmar(*command)
    )


def test_doctor_says_whether_class_and_port_are_there_and_what_stops_the_device(folder):
    (folder / "own_board.py").write_text(BOARD)
    (folder / "own.yaml").write_text(FILE + "  port: /dev/ttyNONE\n")
    dies, driver, device = diagnose_hardware("own.yaml")[-3:]
    assert (dies.what, dies.level) == ("own.yaml", "advice")
    assert dies.found.startswith("NOTHING BELOW THE DRIVER STOPS THE ACTUATORS WHEN IT DIES")
    assert (driver.level, driver.found) == ("ok", "own_board:Board, your own class")
    assert (device.what, device.level) == ("own.yaml: device", "wrong")
    assert "/dev/ttyNONE: there is no such serial port." in device.found


def test_doctor_reports_a_class_that_cannot_be_used(folder):
    (folder / "own_board.py").write_text(LACKING)
    (driver,) = (each for each in diagnose_hardware("own.yaml") if each.what == "own.yaml: driver")
    assert driver.level == "wrong"
    assert "driver 'own_board:Board': " in driver.found
    assert "lacks write. " in driver.found
    assert driver.fix == "See docs/own-driver.md."


def test_list_shows_its_file_and_imports_nothing(folder, fulmar, monkeypatch):
    (folder / "mine" / "hardware").mkdir(parents=True)
    (folder / "mine" / "hardware" / "board.yaml").write_text(FILE)
    monkeypatch.setenv("FULMAR_CONFIGS", str(folder / "mine"))
    code, out, _ = fulmar("list", "hardware", "--json")
    assert code == 0
    assert "board" in json.loads(out)["hardware"]


def test_commission_names_its_channels(folder):
    (folder / "own.yaml").write_text(FILE + "  order: [2, 5, 4, 7, 6, 1, 0, 3]\n")
    wires = wires_of(load_hardware("own.yaml"))
    assert [(wire.name, wire.actuator) for wire in wires][:2] == [("channel 0", 2), ("channel 1", 5)]
    (folder / "own.yaml").write_text(
        FILE.replace("floating_platform", "kingfisher") + "  wiring: [-right, left]\n"
    )
    assert [(wire.name, wire.sign) for wire in wires_of(load_hardware("own.yaml"))] == [
        ("left channel", -1.0),
        ("right channel", 1.0),
    ]
