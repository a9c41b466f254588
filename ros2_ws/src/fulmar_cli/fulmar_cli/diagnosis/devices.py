"""Checks of what a robot is driven through: rights to serial ports and GPIO chips, and hardware files."""

from __future__ import annotations

import grp
import os
from collections.abc import Sequence
from pathlib import Path

from fulmar_cli.diagnosis.check_result import Finding
from fulmar_cli.diagnosis.installation import check_module
from fulmar_core.config.errors import FulmarError
from fulmar_core.config.paths import config_names

PATTERNS = ("ttyUSB*", "ttyACM*", "ttyAMA*", "ttyTHS*", "gpiochip*")  # adapters, Raspberry Pi, Jetson
PORTS = "ls -l /dev/serial/by-id /dev/gpiochip*   # and name one of them in the hardware file"


def devices_of(folder: Path = Path("/dev")) -> list[Path]:
    """Serial ports and GPIO chips of this computer."""
    return sorted(path for pattern in PATTERNS for path in folder.glob(pattern))


def check_permissions(devices: Sequence[Path], *, hardware: bool) -> Finding:
    """Whether this user may read and write devices.

    Args:
        devices: As in `devices_of`.
        hardware: Whether a robot is to be driven through them.
    """
    what = "serial ports and GPIO"
    closed = [device for device in devices if not os.access(device, os.R_OK | os.W_OK, effective_ids=True)]
    if not closed:
        return Finding(what, "ok", ", ".join(map(str, devices)) or "none here")
    fixes = dict.fromkeys(map(_opening, closed))
    found = f"no right to read and write {', '.join(map(str, closed))}"
    return Finding(what, "wrong" if hardware else "advice", found, " && ".join(fixes))


def _opening(device: Path) -> str:
    """The command that lets this user have a device."""
    about = device.stat()
    if not about.st_gid or about.st_mode & 0o060 != 0o060:  # joining the group would not do
        return f"sudo chown $USER {device}"
    try:
        group = grp.getgrgid(about.st_gid).gr_name
    except KeyError:
        return f"sudo chown $USER {device}"
    return f"sudo usermod -aG {group} $USER && newgrp {group}"


def diagnose_hardware(name: str | None) -> list[Finding]:
    """Check hardware files: what stops each device when its driver dies, and whether a named one is there.

    Args:
        name: Of `configs/hardware`, or a path that ends in `.yaml`; all that are known by default.

    Raises:
        ConfigError: There is no such file, or it has a mistake.
    """
    from hardware_drivers.devices import own_watchdog, when_the_driver_dies
    from hardware_drivers.hardware import load_hardware
    from hardware_drivers.own_driver import check_own_driver
    from hardware_drivers.presence import check_presence
    from hardware_drivers.settings import OwnDriver

    findings = []
    for each in [name] if name else config_names("hardware"):
        hardware = load_hardware(each)
        findings += [check_module(module, "hardware") for module in hardware.needs]
        protected = own_watchdog(hardware.driver) is not None
        dies = when_the_driver_dies(hardware.driver)
        cut = "" if protected else "See docs/hardware.md, 'Whose watchdog': keep a power switch within reach."
        findings.append(Finding(each, "ok" if protected else "advice", dies, cut))
        if isinstance(hardware.driver, OwnDriver):
            found = f"{hardware.driver.kind}, your own class"
            try:
                check_own_driver(hardware.driver)
                findings.append(Finding(f"{each}: driver", "ok", found))
            except FulmarError as error:
                findings.append(Finding(f"{each}: driver", "wrong", str(error), "See docs/own-driver.md."))
        if name:
            try:
                check_presence(hardware.driver)
                findings.append(Finding(f"{each}: device", "ok", "its port is there"))
            except (FulmarError, ImportError) as error:
                findings.append(Finding(f"{each}: device", "wrong", str(error), PORTS))
    return list(dict.fromkeys(findings))
