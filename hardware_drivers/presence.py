"""Check before the start that a device's port, chip or host exists."""

from __future__ import annotations

import os
import socket
from collections.abc import Sequence
from glob import glob
from importlib.util import find_spec
from pathlib import Path

from fulmar_core.config.errors import ConfigError, DeviceError
from hardware_drivers.gpio import FILE_CHIP, line_of
from hardware_drivers.settings import (
    Driver,
    GpioValves,
    OwnDriver,
    PwmValves,
    XPlane,
)

CONNECT_S = 0.7  # a host that has not accepted a connection by then is reported as absent [s]
TCP = ("tcp://", "tcp:")
UDP = ("udpin:", "udpout:", "udp:")


def check_messages(driver: Driver) -> None:
    """Raise ConfigError where the ROS messages of a driver are not installed."""
    package = driver.needs_messages
    if package and find_spec(package) is None:
        short = package.removesuffix("_msgs")
        raise ConfigError(
            f"driver '{driver.kind}' needs {package}, which is not installed. Run: fulmar install-{short}"
        )


def check_presence(driver: Driver, port: str = "") -> None:
    """Reject a driver whose port does not exist; takes under a second.

    A device that exists and is silent passes: the driver waits for its first report. X-Plane has to answer.

    Args:
        driver: The driver of a hardware file.
        port: Takes the place of the file's port; empty: the file's.

    Raises:
        ConfigError: ROS messages of the driver are not installed.
        DeviceError: There is no such port, chip, line or host, or this user may not use it.
    """
    check_messages(driver)
    if isinstance(driver, GpioValves):
        _check_chip(port or driver.port, driver.every_line)
    elif isinstance(driver, PwmValves):
        _check_pwm(port or driver.port)
    elif isinstance(driver, XPlane):
        from hardware_drivers.xplane_link import XPlaneLink

        XPlaneLink(port or driver.port, within_s=CONNECT_S).close()
    elif isinstance(driver, OwnDriver) and "/gpiochip" in (port or driver.port):
        _check_chip(port or driver.port, ())
    elif hasattr(driver, "port") and (address := port or driver.port):
        if address.startswith(TCP):
            _check_host(address)
        elif not address.startswith(UDP):
            _check_serial(address.split(",")[0])


def _check_pwm(path: str) -> None:
    if not Path(path).is_dir():
        chips = _known("PWM chips", sorted(glob("/sys/class/pwm/*")))
        raise DeviceError(
            f"{path}: there is no such PWM chip. {chips} Name its folder with `port:` in the hardware file."
        )


def _check_serial(path: str) -> None:
    if not Path(path).exists():
        from serial.tools.list_ports import comports

        ports = [f"{port.device} ({port.description})" for port in comports()]
        raise DeviceError(
            f"{path}: there is no such serial port. {_known('Serial ports', ports)} "
            "Connect the device, or name its port with `port:` in the hardware file."
        )
    if not os.access(path, os.R_OK | os.W_OK):
        raise DeviceError(
            f"{path}: this user may not use the port. Add the user to the group that owns it "
            "(`sudo usermod -aG dialout $USER`) and log in again."
        )


def _check_host(address: str) -> None:
    host, _, number = address.removeprefix("tcp:").removeprefix("//").rpartition(":")
    if not host or not number.isdecimal():
        return  # the driver rejects the address, and names the format
    try:
        with socket.create_connection((host, int(number)), timeout=CONNECT_S):
            pass
    except (OSError, OverflowError) as error:
        raise DeviceError(
            f"{address}: no connection within {CONNECT_S:g} s ({error}). Is the device on, and this computer in its "
            "network? Name another address with `port:` in the hardware file."
        ) from error


def _check_chip(address: str, lines: Sequence[str]) -> None:
    if address.startswith(FILE_CHIP):
        if not Path(address.removeprefix(FILE_CHIP)).exists():
            raise DeviceError(f"{address}: there is no such file of levels.")
        return
    if not Path(address).exists():
        raise DeviceError(
            f"{address}: there is no such GPIO chip. {_known('GPIO chips', sorted(glob('/dev/gpiochip*')))} "
            "Name the chip with `port:` in the hardware file; `gpiodetect` lists them."
        )
    import gpiod

    try:
        with gpiod.Chip(address) as chip:
            missing = [line for line in lines if not _has(chip, line)]
    except OSError as error:
        raise DeviceError(f"{address}: the chip cannot be opened ({error}). May this user use it?") from error
    if missing:
        raise DeviceError(
            f"{address}: the chip has no line {', '.join(missing)}. Is this the right board? "
            "`gpioinfo` shows the names and numbers of all lines."
        )


def _has(chip: object, line: str) -> bool:
    try:
        chip.line_offset_from_id(line_of(line))  # type: ignore[attr-defined]
    except (OSError, ValueError):
        return False
    return True


def _known(what: str, names: Sequence[str]) -> str:
    return f"{what} here: {', '.join(names) if names else 'none'}."
