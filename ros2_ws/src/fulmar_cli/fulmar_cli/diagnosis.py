"""What `fulmar doctor` looks at; each check is a function that returns one finding."""

from __future__ import annotations

import importlib
import os
import shutil
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_cli.extras import EXTRAS
from fulmar_core.errors import FulmarError
from fulmar_core.paths import config_directories, config_names
from fulmar_core.robot import load_robot
from fulmar_core.tasks import load_task

LATE_MS = 2.0  # what a 50 Hz loop may be late at the 99th percentile
FREE_BYTES = 1_000_000_000
PARTS = {EXTRAS[extra][0]: extra for extra in ("ros", "sim", "policy", "bags", "view")}


@dataclass(frozen=True)
class Finding:
    """The outcome of one check."""

    what: str
    ok: bool
    found: str
    advice: str = ""
    warning: bool = False  # worth a person's look, though nothing is broken

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def diagnose() -> list[Finding]:
    """Run every check."""
    findings = [_python(), *(_part(module, extra) for module, extra in PARTS.items())]
    checks: tuple[Callable[[], Finding], ...] = (_configs, _policies, _ros_round_trip, _wires, _timing, _disk)
    return findings + [check() for check in checks]


def diagnose_hardware(name: str | None) -> list[Finding]:
    """Check hardware files: what stops each device when its driver dies, and whether a named one is there.

    Args:
        name: Of `configs/hardware`, or a path that ends in `.yaml`; all that are known by default.

    Raises:
        ConfigError: There is no such file, or it has a mistake.
    """
    from hardware_drivers.devices import own_watchdog, when_the_driver_dies
    from hardware_drivers.own_driver import check_own_driver
    from hardware_drivers.presence import check_presence
    from hardware_drivers.settings import OwnDriver, load_hardware

    findings = []
    for each in [name] if name else config_names("hardware"):
        hardware = load_hardware(each)
        findings += [_part(module, "hardware") for module in hardware.needs]
        unprotected = own_watchdog(hardware.driver) is None
        findings.append(Finding(each, True, when_the_driver_dies(hardware.driver), warning=unprotected))
        if isinstance(hardware.driver, OwnDriver):
            try:
                check_own_driver(hardware.driver)
                findings.append(Finding(f"{each}: driver", True, f"{hardware.driver.kind}, your own class"))
            except FulmarError as error:
                findings.append(Finding(f"{each}: driver", False, str(error), "See docs/own-driver.md."))
        if name:
            try:
                check_presence(hardware.driver)
                findings.append(Finding(f"{each}: device", True, "its port is there"))
            except (FulmarError, ImportError) as error:
                findings.append(Finding(f"{each}: device", False, str(error), "See docs/hardware.md."))
    return list(dict.fromkeys(findings))


def _python() -> Finding:
    found = ".".join(map(str, sys.version_info[:3]))
    return Finding(
        "Python", (3, 11) <= sys.version_info[:2] <= (3, 13), found, "Use Python 3.11, 3.12 or 3.13."
    )


def _part(module: str, extra: str) -> Finding:
    try:
        importlib.import_module(module)
    except ImportError as error:
        return Finding(
            module, False, str(error), f"Install the extra '{extra}': `make setup` in the checkout."
        )
    try:
        return Finding(module, True, version(module))
    except PackageNotFoundError:
        return Finding(module, True, "installed by the system")


def _configs() -> Finding:
    try:
        for name in config_names("robots"):
            load_robot(name)
        for name in config_names("tasks"):
            load_task(name)
    except FulmarError as error:
        return Finding("configuration", False, str(error), "Mend the file that is named.")
    return Finding("configuration", True, ", ".join(map(str, config_directories())))


def _policies() -> Finding:
    try:
        from policy_server.controllers import shipped_policies
        from policy_server.policy import Policy

        for folder in shipped_policies():
            from fulmar_core.policy_bundle import read_passport

            passport = read_passport(folder)
            Policy(
                folder, load_robot(passport.robot), load_task(passport.task), control_hz=passport.control_hz
            )
    except (FulmarError, ImportError) as error:
        return Finding(
            "shipped policies", False, str(error), "Check the files out again: `git checkout policy_server`."
        )
    return Finding(
        "shipped policies", True, ", ".join(folder.name for folder in shipped_policies()) or "none"
    )


def _ros_round_trip() -> Finding:
    try:
        from fulmar_bringup.ros_echo import round_trip_ms

        best = round_trip_ms()
    except Exception as error:  # noqa: BLE001 - whatever keeps ROS from working is the finding
        return Finding("ROS 2 publish and receive", False, f"{type(error).__name__}: {error}", _ROS_ADVICE)
    if best is None:
        return Finding("ROS 2 publish and receive", False, "no message came back within 5 s", _ROS_ADVICE)
    domain = os.environ.get("ROS_DOMAIN_ID", "0")
    return Finding("ROS 2 publish and receive", True, f"{best:.2f} ms (median) in domain {domain}")


def _wires() -> Finding:
    """Whether what is published for the robots of this domain can reach them."""
    try:
        from fulmar_bringup.robot_operator import operator

        with operator() as person:
            robots, unfit = person.look_at_wires()
    except Exception as error:  # noqa: BLE001 - whatever keeps ROS from working is the finding
        return Finding("running robots", False, f"{type(error).__name__}: {error}", _ROS_ADVICE)
    names = ", ".join(sorted(space.strip("/") for space in robots)) or "none in this domain"
    return Finding(
        "running robots",
        not unfit,
        "; ".join(unfit) or names,
        "Give that publisher the type of the wire, and reliable quality of service: README, 'The wires'.",
    )


_ROS_ADVICE = "Is loopback up and /dev/shm writable, and not full? Try another ROS_DOMAIN_ID."


def _timing() -> Finding:
    late = []
    for _ in range(100):
        due = time.monotonic() + 0.005
        time.sleep(max(0.0, due - time.monotonic()))
        late.append(1000.0 * (time.monotonic() - due))
    p99 = float(np.percentile(late, 99))
    advice = "Something else takes the processor; real-time runs will be late. Lock-step runs do not mind."
    return Finding("timing", p99 < LATE_MS, f"a sleeping loop wakes {p99:.2f} ms late (p99)", advice)


def _disk() -> Finding:
    free = shutil.disk_usage(Path.cwd()).free
    return Finding(
        "disk", free > FREE_BYTES, f"{free / 1e9:.1f} GB free here", "Bags need room: at least 1 GB."
    )
