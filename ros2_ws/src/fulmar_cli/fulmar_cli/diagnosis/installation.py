"""Checks of the installation: Python, the parts of Fulmar, configuration files and shipped policies."""

from __future__ import annotations

import importlib
import sys
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec

from fulmar_cli.diagnosis.check_result import Finding
from fulmar_cli.installation.extras import EXTRAS
from fulmar_cli.installation.installed_as import install_command, repair_command
from fulmar_core.config.errors import ConfigError, FulmarError
from fulmar_core.config.paths import config_directories, config_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task

OLDEST_PYTHON, NEWEST_PYTHON = (3, 11), (3, 14)


def check_python(found: tuple[int, ...] = sys.version_info[:3]) -> Finding:
    """Whether this Python is one that Fulmar is tested with."""
    good = OLDEST_PYTHON <= found[:2] <= NEWEST_PYTHON
    text = ".".join(map(str, found))
    return Finding("Python", "ok" if good else "wrong", text, "" if good else "make setup PYTHON=python3.12")


def check_extra(extra: str) -> Finding:
    """Whether the first module of an extra can be imported."""
    return check_module(EXTRAS[extra][0], extra)


def check_module(module: str, extra: str) -> Finding:
    """Whether a module can be imported, and its version.

    Args:
        module: Name of the module.
        extra: The extra that brings it.
    """
    try:
        importlib.import_module(module)
    except ImportError as error:
        fix = f"{install_command([extra], [module])}   # brings the extra '{extra}'"
        return Finding(module, "wrong", str(error), fix)
    except OSError as error:  # such as Matplotlib's, where it may write nowhere
        return Finding(module, "wrong", str(error), "export TMPDIR=DIR   # a folder that you may write")
    except (RuntimeError, AttributeError) as error:  # such as MuJoCo's, of a MUJOCO_GL that it cannot load
        return Finding(module, "wrong", str(error), "unset MUJOCO_GL" if module == "mujoco" else "")
    try:
        return Finding(module, "ok", version(module))
    except PackageNotFoundError:
        return Finding(module, "ok", "installed by the system")


def check_tf() -> Finding:
    """Whether frames can be published for RViz and Foxglove."""
    if find_spec("tf2_msgs") is None:
        found = (
            "not installed: /tf and /tf_static are not published (nothing but RViz and Foxglove needs them)"
        )
        return Finding("tf2_msgs", "advice", found, "fulmar install-tf")
    return Finding("tf2_msgs", "ok", "installed")


def check_renderer() -> Finding:
    """Whether cameras of simulated robots can be drawn, and by what."""
    if find_spec("mujoco") is None:
        return Finding("renderer of cameras", "advice", "needs mujoco", install_command(["sim"], ["mujoco"]))
    from sim_nodes.camera.opengl import check_variable, find_platform

    try:
        return Finding("renderer of cameras", "ok", find_platform())
    except ConfigError as error:
        found = str(error)
    try:
        check_variable()
    except ConfigError:
        return Finding("renderer of cameras", "wrong", found, "unset MUJOCO_GL")
    said, _, fix = found.partition(" Run: ")
    return Finding("renderer of cameras", "advice", said, fix or "unset MUJOCO_GL")


def check_configuration() -> Finding:
    """Whether every robot and every task can be read."""
    try:
        for name in config_names("robots"):
            load_robot(name)
        for name in config_names("tasks"):
            load_task(name)
    except FulmarError as error:
        fix = f"{repair_command('configs')}   # discards your changes; or correct that line"
        return Finding("configuration", "wrong", str(error), fix)
    return Finding("configuration", "ok", ", ".join(map(str, config_directories())))


def check_policies() -> Finding:
    """Whether every shipped policy loads and fits its robot and its task."""
    try:
        from fulmar_core.loop.policy_bundle import read_passport
        from policy_server.controllers import shipped_policies
        from policy_server.policy import Policy

        folders = shipped_policies()
        for folder in folders:
            passport = read_passport(folder)
            robot, task = load_robot(passport.robot), load_task(passport.task)
            Policy(folder, robot, task, control_hz=passport.control_hz)
    except (FulmarError, ImportError) as error:
        return Finding("shipped policies", "wrong", str(error), repair_command("policy_server"))
    return Finding("shipped policies", "ok", ", ".join(folder.name for folder in folders) or "none")


def check_envelopes() -> Finding:
    """Whether each robot lies inside the certified set of its shipped policy, where there is one."""
    what = "certified sets"
    try:
        from fulmar_bringup.envelope_check import envelope_problems, other_core
        from fulmar_core.loop.policy_bundle import read_passport
        from policy_server.controllers import shipped_policies

        certified, outside = [], []
        for folder in shipped_policies():
            passport = read_passport(folder)
            if passport.envelope is None:
                continue
            certified.append(folder.name)
            older = "measured with another version of the core" if other_core(folder) else ""
            problems = envelope_problems(folder, load_robot(passport.robot), passport.task)
            outside += [f"{folder.name}: {problem}" for problem in (*problems, older) if problem]
    except (FulmarError, ImportError) as error:
        return Finding(what, "wrong", str(error), "fulmar certify BUNDLE --write")
    if outside:
        return Finding(what, "advice", "; ".join(outside), "fulmar certify BUNDLE --again --write")
    return Finding(what, "ok", ", ".join(certified) or "none")
