"""Whether ROS can be loaded in an environment: looked at before rclpy is, which would end the process or blame others.

The middleware of another name ends a process inside of rcl with exit code 102 as soon as rclpy is imported.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.abc import MetaPathFinder
from importlib.machinery import EXTENSION_SUFFIXES, PathFinder
from pathlib import Path

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.module_path import PYTHONPATH, is_of_another_python

RCLPY, BINDINGS = "rclpy", "_rclpy_pybind11"
MIDDLEWARE, USUAL = "RMW_IMPLEMENTATION", "rmw_fastrtps_cpp"
DOMAIN, LARGEST_DOMAIN = "ROS_DOMAIN_ID", 232  # of DDS
# Where rcl_logging writes, by the variable that says so, in the order in which it asks them.
LOG_FOLDERS = {"ROS_LOG_DIR": "", "ROS_HOME": "log", "HOME": ".ros/log"}
LOADED_S = 30.0  # for another process to load rclpy on a busy computer


@dataclass(frozen=True)
class Fault:
    """A setting of an environment with which ROS does not work, and the command that corrects it."""

    found: str
    fix: str


def ros_fault(environment: Mapping[str, str]) -> Fault | None:
    """The first fault of an environment; None if rclpy can be loaded and started."""
    checks = (_another_python, _another_middleware, _domain, log_fault)
    return next((fault for check in checks if (fault := check(environment))), None)


def check_log_folder(environment: Mapping[str, str]) -> None:
    """Refuse an environment whose folder of logs cannot be written.

    Raises:
        ConfigError: With the folder, the reason and the remedy.
    """
    fault = log_fault(environment)
    if fault:
        raise _refusal(fault)


def log_fault(environment: Mapping[str, str]) -> Fault | None:
    """Whether rclpy could not write its logs; makes the folder, as rclpy does."""
    name = next((each for each in LOG_FOLDERS if environment.get(each)), "")
    fix = "export ROS_LOG_DIR=/tmp/ros_logs   # or another folder that you may write"
    if not name:
        return Fault("ROS has no folder for its logs, for HOME is not set", fix)
    folder = Path(environment[name]).expanduser() / LOG_FOLDERS[name]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        return Fault(f"ROS cannot write its logs into {folder}, by {name} ({error.strerror})", fix)
    if not os.access(folder, os.W_OK | os.X_OK):
        return Fault(f"ROS may not write its logs into {folder}, by {name}", fix)
    return None


def look_before_loading() -> None:
    """From now on, refuse to import rclpy where it cannot work."""
    if RCLPY not in sys.modules and not any(isinstance(each, _Refusal) for each in sys.meta_path):
        sys.meta_path.insert(0, _Refusal())


class _Refusal(MetaPathFinder):
    """Is asked for each module before it is searched for, and finds none."""

    def find_spec(self, fullname: str, path: object = None, target: object = None) -> None:
        """Refuse rclpy.

        Raises:
            ConfigError: It would not work here.
        """
        if fullname == RCLPY:
            fault = ros_fault(os.environ)
            if fault and PathFinder.find_spec(RCLPY):  # that it is missing is said elsewhere
                raise _refusal(fault)
            sys.meta_path = [
                each for each in sys.meta_path if each is not self
            ]  # Python goes through the old one


def _refusal(fault: Fault) -> ConfigError:
    return ConfigError(f"{fault.found}. Run: {fault.fix}")


def _another_python(environment: Mapping[str, str]) -> Fault | None:
    """Whether PYTHONPATH has an rclpy that this Python cannot load, as a sourced ROS of another version has."""
    folders = [Path(part) for part in environment.get(PYTHONPATH, "").split(os.pathsep) if part]
    for folder in folders:
        mine = [folder / RCLPY / f"{BINDINGS}{suffix}" for suffix in EXTENSION_SUFFIXES]
        if (folder / RCLPY).is_dir() and not any(path.exists() for path in mine):
            own = "{}.{}".format(*sys.version_info)
            whose = "of another Python" if is_of_another_python(str(folder)) else "without its library"
            fix = "env -u PYTHONPATH -u LD_LIBRARY_PATH -u AMENT_PREFIX_PATH fulmar ...   # or do not source that ROS"
            return Fault(f"PYTHONPATH has an rclpy {whose} in {folder}, and this is Python {own}", fix)
    return None


def _another_middleware(environment: Mapping[str, str]) -> Fault | None:
    """Whether rclpy ends the process for want of the middleware that the environment names; tried in another one."""
    name = environment.get(MIDDLEWARE, "")
    if name in ("", USUAL):
        return None
    try:
        tried = subprocess.run(
            [sys.executable, "-P", "-c", f"import {RCLPY}.{BINDINGS}"],
            env=dict(environment),
            capture_output=True,
            text=True,
            errors="replace",
            timeout=LOADED_S,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None  # it may work
    if not tried.returncode or "No module named" in tried.stderr:  # which is said elsewhere
        return None
    here = re.search(r"instead found '(\w+)'", tried.stderr)
    has = f"this ROS has {here[1]} only" if here else f"rcl ended with exit code {tried.returncode}"
    return Fault(f"{MIDDLEWARE}={name} is not installed: {has}", f"unset {MIDDLEWARE}")


def _domain(environment: Mapping[str, str]) -> Fault | None:
    """Whether the domain is one of DDS."""
    found = domain_problem(environment)
    return Fault(found, f"export {DOMAIN}=0") if found else None


def domain_problem(environment: Mapping[str, str]) -> str:
    """Why ROS_DOMAIN_ID is no domain of DDS; empty if it is one, or not set."""
    given = environment.get(DOMAIN, "")
    if not given or (given.isdecimal() and int(given) <= LARGEST_DOMAIN):
        return ""
    return f"{DOMAIN} = '{given}' must be a whole number from 0 to {LARGEST_DOMAIN}"
