"""A user's driver class, and the device that is made of it."""

from __future__ import annotations

from fulmar_core.robots.robot_file import load_robot
from hardware_drivers.devices import make_device
from hardware_drivers.driver_backend import DriverBackend
from hardware_drivers.hardware import load_hardware

BOARD = """
import numpy as np
from hardware_drivers.driver import DeviceDriver

class Board(DeviceDriver):
    def __init__(self, robot, settings, *, patience_s):
        self.settings, self.patience_s = settings, patience_s
        self.sent, self.closed = [], 0
    def write(self, command):
        self.sent.append(command.tolist())
    def close(self):
        self.closed += 1
"""
PLATFORM = "floating_platform"


def written(folder, code, robot=PLATFORM, more=""):
    """A hardware file whose driver is the class `Board` of this code."""
    (folder / "own_board.py").write_text(code)
    path = folder / "own.yaml"
    path.write_text(f"title: t\nrobot: {robot}\ndriver:\n  kind: own_board:Board\n{more}")
    return str(path)


def made(folder, code=BOARD, robot=PLATFORM, more="", patience_s=1.5) -> tuple[DriverBackend, object]:
    """The device, and the user's object in it."""
    device = make_device(
        load_robot(robot), load_hardware(written(folder, code, robot, more)), port="", patience_s=patience_s
    )
    return device, device._driver._driver


def with_method(method, body):
    return BOARD + f"    def {method}:\n        {body}\n"
