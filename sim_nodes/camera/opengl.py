"""Finds what draws images without a screen: EGL or OSMesa, looked for in a process of its own.

OpenGL can end a process by a signal, and some errors of MuJoCo are tracebacks: here each becomes one line.
"""

from __future__ import annotations

import contextlib
import functools
import os
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from typing import Any

from fulmar_core.config.errors import ConfigError, did_you_mean
from fulmar_core.config.module_path import own_packages

PLATFORMS = ("egl", "osmesa")
PACKAGES = {"egl": "libegl1 libgl1-mesa-dri", "osmesa": "libosmesa6"}  # of Debian and Ubuntu
VARIABLE = "MUJOCO_GL"
# What MuJoCo takes the variable for: no renderer at all, one that this machine has, or one with a screen.
OFF = ("disable", "disabled", "off", "false", "0")
ANY = ("", "enable", "enabled", "on", "true", "1", "glfw", "glx")
PROBE_S = 60.0  # the first image of a busy computer takes seconds
THREADS = "LP_NUM_THREADS"  # of Mesa's software renderer, which else takes every core


def check_variable() -> None:
    """Refuse a value of MUJOCO_GL with which MuJoCo cannot be imported.

    Raises:
        ConfigError: It has one.
    """
    value = _value()
    if value not in (*PLATFORMS, *OFF, *ANY):
        raise ConfigError(
            f"{VARIABLE} = '{os.environ[VARIABLE]}' is not known: unset it, or set it to egl or "
            f"osmesa.{did_you_mean(value, PLATFORMS)}"
        )


def check_loadable() -> None:
    """Refuse a MUJOCO_GL with which MuJoCo cannot be imported, or loads no library of this machine.

    Raises:
        ConfigError: It has one.
    """
    check_variable()
    problem = problem_of(_value()) if _value() in PLATFORMS else ""
    if problem:
        raise ConfigError(
            f"{VARIABLE} = '{os.environ[VARIABLE]}', and MuJoCo cannot be loaded with it ({problem}). Unset it."
        )


def find_platform() -> str:
    """The platform that draws images here: that of MUJOCO_GL, else the first one that can.

    Raises:
        ConfigError: None can; with what to install.
    """
    check_variable()
    value = _value()
    if value in OFF:
        raise ConfigError(
            f"{VARIABLE} = '{os.environ[VARIABLE]}' switches rendering off, and a camera draws. Unset it, or "
            "set it to egl or osmesa."
        )
    return first_of((value,) if value in PLATFORMS else PLATFORMS)


@functools.cache
def first_of(platforms: tuple[str, ...]) -> str:
    """The first of some platforms that draws here; looked for once in a process.

    Raises:
        ConfigError: None does; with what to install.
    """
    problems = {}
    for name in platforms:
        problems[name] = problem_of(name)
        if not problems[name]:
            return name
    found = "; ".join(f"{name}: {problem}" for name, problem in problems.items())
    packages = " or ".join(PACKAGES[name] for name in platforms)
    raise ConfigError(f"no renderer for cameras ({found}). Run: sudo apt-get install {packages}")


def problem_of(platform: str) -> str:
    """Why a platform cannot draw, in one line; empty where it can. It draws an image in a process of its own."""
    environment = {**os.environ, VARIABLE: platform, THREADS: "1"}
    environment.pop("PYOPENGL_PLATFORM", None)
    environment |= own_packages(environment)
    command = [sys.executable, "-m", "sim_nodes.camera.opengl", platform]
    try:
        done = subprocess.run(
            command,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=PROBE_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"it drew nothing within {PROBE_S:g} s"
    if done.returncode < 0:
        return f"it crashed, by signal {-done.returncode}"
    if done.returncode == 0:
        return ""
    said = done.stderr.decode(errors="replace").strip().splitlines()
    return said[-1] if said else f"it ended with exit code {done.returncode}"


@contextlib.contextmanager
def context(platform: str, width: int, height: int) -> Iterator[Any]:
    """An OpenGL context of a platform, current in this thread, which ends with the block.

    Args:
        platform: One of `PLATFORMS`; only one of them in a process.
        width: Of the largest image [px].
        height: The same.

    Raises:
        ConfigError: The platform cannot draw.
    """
    os.environ.setdefault(THREADS, "1")
    try:
        made = import_module(f"mujoco.{platform}").GLContext(width, height)
        made.make_current()
    except Exception as error:
        raise ConfigError(
            f"no renderer for cameras ({platform}: {_one_line(error)}). "
            f"Run: sudo apt-get install {PACKAGES[platform]}"
        ) from error
    try:
        yield made
    finally:
        made.free()


def _value() -> str:
    return os.environ.get(VARIABLE, "").strip().lower()


def _one_line(error: BaseException) -> str:
    """What went wrong: its first sentence; without a library PyOpenGL has None in its place, and asks that."""
    if isinstance(error, AttributeError) and "NoneType" in str(error):
        return "its library is not installed"
    return " ".join(str(error).split()).partition(". ")[0].rstrip(".") or type(error).__name__


def _draw(platform: str) -> None:
    """Draw one image."""
    import mujoco

    model = mujoco.MjSpec().compile()
    with context(platform, 8, 8):
        mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value).free()


if __name__ == "__main__":
    try:
        _draw(sys.argv[1])
    except Exception as error:  # noqa: BLE001 - whatever it is, it is the answer
        sys.exit(_one_line(error.__cause__ or error))
