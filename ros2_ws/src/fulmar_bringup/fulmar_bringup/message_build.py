"""Builds message packages for which there is no wheel from ROS's wheels, and installs them into this environment.

On a Jazzy machine ROS's own packages are there. Elsewhere /tf stays silent until tf2_msgs is built; action servers
need nav2_msgs, services for simulations simulation_interfaces, the broadcaster control_msgs, and the drivers of PX4
px4_msgs.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib.util import find_spec
from pathlib import Path

from fulmar_core.config.errors import ConfigError, FulmarError

TF2_MSGS, NAV2_MSGS, SIMULATION_INTERFACES, CONTROL_MSGS, PX4_MSGS = PACKAGES = (
    "tf2_msgs",
    "nav2_msgs",
    "simulation_interfaces",
    "control_msgs",
    "px4_msgs",
)
SOURCE = Path(__file__).parent / TF2_MSGS  # with the lock of what builds every package
ERROR = re.compile(r"CMake Error|\berror: [^s]|No matching|ERROR:")
SHOWN = 15  # lines of a failed step
COMPILERS = {"CC": ("cc", "gcc", "clang"), "CXX": ("c++", "g++", "clang++")}


def install_messages(packages: str | Sequence[str], report: Callable[[str], None]) -> bool:
    """Build packages in an environment of their own, which is removed afterwards, and install them.

    Args:
        packages: One or several of `PACKAGES`.
        report: Called with a line for each step.

    Returns:
        False if all are installed already.

    Raises:
        ConfigError: ROS, a compiler or the module `venv` is missing.
        FulmarError: A step failed; with what it printed.
    """
    asked = (packages,) if isinstance(packages, str) else packages
    missing = [package for package in asked if find_spec(package) is None]
    if not missing:
        return False
    words = ", ".join(missing)
    _check_tools(words)
    with tempfile.TemporaryDirectory(prefix="fulmar_tf_") as folder:
        prefix = Path(folder) / "environment"
        python = str(prefix / "bin" / "python")
        # Packages on PYTHONPATH would pass for installed ones, and be missing where CMake looks.
        clean = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        pip = [python, "-m", "pip", "--disable-pip-version-check", "--no-input", "--quiet"]
        report("1/3 install ROS's generators of messages into a temporary environment (250 MB)")
        run = partial(_run, words)
        run([sys.executable, "-m", "venv", str(prefix)], "make an environment", clean)
        lock = str(SOURCE / "requirements.lock")
        run([*pip, "install", "--require-hashes", "-r", lock], "install the generators", clean)
        report(f"2/3 compile {words}")
        for package in missing:
            _compile(package, pip, clean, Path(folder))
        report(f"3/3 install {'it' if len(missing) == 1 else 'them'} into {sys.prefix}")
        wheels = [str(wheel) for wheel in Path(folder).glob("*.whl")]
        into = [*pip, "--python", sys.executable, "install", "--no-deps", "--no-index", *wheels]
        run(into, "install", clean)
    return True


def _compile(package: str, pip: Sequence[str], clean: Mapping[str, str], folder: Path) -> None:
    """Make a wheel of a package in a folder, which has the environment of the generators."""
    prefix = folder / "environment"
    source = shutil.copytree(SOURCE.parent / package, folder / "source" / package)
    environment = {
        **clean,
        "PATH": f"{prefix / 'bin'}{os.pathsep}{os.environ.get('PATH', os.defpath)}",
        "AMENT_PREFIX_PATH": str(prefix),
        "CMAKE_PREFIX_PATH": str(prefix),
    }
    build = [*pip, "wheel", "--no-build-isolation", "--no-deps", "--wheel-dir", str(folder), str(source)]
    _run(package, build, "compile", environment)


def _check_tools(packages: str) -> None:
    if find_spec("rclpy") is None:
        raise ConfigError(
            f"{packages} needs ROS in this environment, and there is none: install 'fulmar[ros]'."
        )
    for variable, names in COMPILERS.items():
        if not any(shutil.which(name) for name in (os.environ.get(variable) or "", *names) if name):
            raise ConfigError(
                f"no compiler was found ({', '.join(names)}; ${variable} names another one). "
                "On Debian and Ubuntu: apt install g++ python3-dev"
            )
    headers = Path(sysconfig.get_path("include"))
    if not (headers / "Python.h").is_file():
        raise ConfigError(
            f"this Python has no headers ({headers / 'Python.h'}). On Debian and Ubuntu: apt install python3-dev"
        )
    if find_spec("ensurepip") is None:
        raise ConfigError(
            "this Python cannot make environments. On Debian and Ubuntu: apt install python3-venv"
        )


def _run(packages: str, command: Sequence[str], step: str, environment: dict[str, str]) -> None:
    """Run a command in silence.

    Raises:
        FulmarError: It failed; with the first error that it printed.
    """
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        lines = (done.stdout + done.stderr).strip().splitlines()
        first = next((at for at, line in enumerate(lines) if ERROR.search(line)), max(0, len(lines) - SHOWN))
        shown = "\n".join(lines[first : first + SHOWN])
        raise FulmarError(f"{packages}: could not {step}:\n{shown}")
