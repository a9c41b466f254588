"""Builds tf2_msgs, for which there is no wheel, from ROS's wheels, and installs it into this environment.

On a Jazzy machine ROS's own tf2_msgs is there. Elsewhere /tf stays silent until it is built; nothing else needs it.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path

from fulmar_core.config.errors import ConfigError, FulmarError

PACKAGE = "tf2_msgs"
SOURCE = Path(__file__).parent / PACKAGE
ERROR = re.compile(r"CMake Error|\berror: [^s]|No matching|ERROR:")
SHOWN = 15  # lines of a failed step
COMPILERS = {"CC": ("cc", "gcc", "clang"), "CXX": ("c++", "g++", "clang++")}


def install_tf2_msgs(report: Callable[[str], None]) -> bool:
    """Build and install the package in an environment of its own, which is removed afterwards.

    Args:
        report: Called with a line for each step.

    Returns:
        False if it is installed already.

    Raises:
        ConfigError: ROS, a compiler or the module `venv` is missing.
        FulmarError: A step failed; with what it printed.
    """
    if find_spec(PACKAGE) is not None:
        return False
    _check_tools()
    with tempfile.TemporaryDirectory(prefix="fulmar_tf_") as folder:
        prefix = Path(folder) / "environment"
        source = shutil.copytree(SOURCE, Path(folder) / "source")
        python = str(prefix / "bin" / "python")
        # Packages on PYTHONPATH would pass for installed ones, and be missing where CMake looks.
        clean = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        pip = [python, "-m", "pip", "--disable-pip-version-check", "--no-input", "--quiet"]
        report("1/3 install ROS's generators of messages into a temporary environment (250 MB)")
        _run([sys.executable, "-m", "venv", str(prefix)], "make an environment", clean)
        lock = str(source / "requirements.lock")
        _run([*pip, "install", "--require-hashes", "-r", lock], "install the generators", clean)
        report(f"2/3 compile {PACKAGE}")
        environment = {
            **clean,
            "PATH": f"{prefix / 'bin'}{os.pathsep}{os.environ.get('PATH', os.defpath)}",
            "AMENT_PREFIX_PATH": str(prefix),
            "CMAKE_PREFIX_PATH": str(prefix),
        }
        build = [*pip, "wheel", "--no-build-isolation", "--no-deps", "--wheel-dir", folder, str(source)]
        _run(build, "compile", environment)
        report(f"3/3 install it into {sys.prefix}")
        wheels = [str(wheel) for wheel in Path(folder).glob("*.whl")]
        _run(
            [*pip, "--python", sys.executable, "install", "--no-deps", "--no-index", *wheels],
            "install",
            clean,
        )
    return True


def _check_tools() -> None:
    if find_spec("rclpy") is None:
        raise ConfigError("tf2_msgs needs ROS in this environment, and there is none: install 'fulmar[ros]'.")
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


def _run(command: Sequence[str], step: str, environment: dict[str, str]) -> None:
    """Run a command in silence.

    Raises:
        FulmarError: It failed; with the first error that it printed.
    """
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        lines = (done.stdout + done.stderr).strip().splitlines()
        first = next((at for at, line in enumerate(lines) if ERROR.search(line)), max(0, len(lines) - SHOWN))
        shown = "\n".join(lines[first : first + SHOWN])
        raise FulmarError(f"{PACKAGE}: could not {step}:\n{shown}")
