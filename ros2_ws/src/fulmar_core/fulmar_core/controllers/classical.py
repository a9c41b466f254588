"""Loads classical laws with their gains, and checks which robots and tasks there is one for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names, config_path
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.controllers.by_kind import EVERY, LAWS, Entry, driven_by, laws_of
from fulmar_core.controllers.default_gains import rounded
from fulmar_core.controllers.law import Law
from fulmar_core.robots.actuators.families import row_of
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task


def entry_of(robot: Robot, law: str | None) -> Entry:
    """The entry of a law, or the usual one of the robot; `check_pair` says whether it is for this robot.

    Raises:
        ConfigError: No law is for actuators of this kind.
    """
    laws = laws_of(robot)
    return laws.get(law or "", next(iter(laws.values())))


def check_pair(robot: Robot, task: Task, *, law: str | None = None) -> None:
    """Reject a robot and a task that no classical law, or not the named one, is for, or that it has no gains for.

    Raises:
        ConfigError: With what would be allowed.
    """
    if check_law(robot, task, law=law) is None:
        gains_of(robot, law)


def check_law(robot: Robot, task: Task, *, law: str | None = None) -> Path | None:
    """The part of `check_pair` that computes no default gains.

    Returns:
        The file with the law's gains; None where default gains are to be computed.

    Raises:
        ConfigError: With what would be allowed.
    """
    family, entry = robot.actuators.kind, entry_of(robot, law)
    if law in EVERY and law not in laws_of(robot):
        raise ConfigError(
            f"controller '{law}' is for {driven_by(law)}; '{robot.name}' is one of the {robot.kind.plural} with "
            f"{family}. Use --controller classical."
        )
    task.check_kind(robot)
    if task.kind not in entry.tasks:
        raise ConfigError(
            f"no classical law does '{task.name}' on '{robot.name}' ({family}); there is one for: "
            f"{', '.join(entry.tasks)}. Use --controller policy, which `fulmar train {robot.name} {task.name}` makes."
        )
    try:
        entry.check(robot)
    except ValueError as error:
        raise ConfigError(f"no classical law is for '{robot.name}': {error}") from error
    return _find_gains(robot, entry)


def has_law(robot: Robot, task: Task) -> bool:
    """Whether there is a classical law for a pair."""
    laws = row_of(LAWS[robot.kind.name], type(robot.actuators)) or {}
    return any(task.kind in entry.tasks for entry in list(laws.values())[:1])


def load_classical(
    robot: Robot, task: Task, *, control_hz: float | None = None, law: str | None = None, seed: int = 0
) -> Law:
    """The law for a robot and a task, with the gains that `gains_of` finds.

    Args:
        robot: The robot.
        task: The task.
        control_hz: Command rate; the robot's own by default [Hz].
        law: Name of the law; by default the one of the robot's family, called "classical".
        seed: Of the noise of a law that draws any; added to the one of its gains.

    Raises:
        ConfigError: No law for the pair, no gains for this robot, a mistake in them, or a rate that the physics
            cannot keep.
    """
    check_pair(robot, task, law=law)
    entry = entry_of(robot, law)
    gains = gains_of(robot, law)
    if seed and entry.draws:
        gains = replace(gains, seed=gains.seed + seed)
    try:
        return entry.law_of(task)(robot, task, gains, control_hz=control_hz, name=law or "classical")
    except ValueError as error:
        hz = control_hz or robot.timing.control_hz
        raise ConfigError(f"{entry.law.law} for '{robot.name}' at {hz:g} Hz: {error}") from error


def gains_of(robot: Robot, law: str | None = None) -> Any:
    """Gains of a law for a robot: those of `configs/controllers/<robot>_<law>.yaml`, or the default ones without it.

    Args:
        robot: The robot.
        law: Name of the law; any other name and None mean the one of the robot's family.

    Raises:
        ConfigError: A mistake in the file, no file where the law has no default gains, or a robot whose actuators
            cannot do what they are computed for.
    """
    entry = entry_of(robot, law)
    path = _find_gains(robot, entry)
    if path is not None:
        return load_config(entry.gains, path)
    assert entry.defaults is not None
    try:
        return rounded(entry.defaults(robot))
    except ValueError as error:
        raise ConfigError(f"no default gains of '{entry.law.law}' for '{robot.name}': {error}") from error


def gains_path(robot: Robot, law: str | None = None) -> Path | None:
    """The file with the gains of a law for a robot; None where default gains are used; rest as in `gains_of`."""
    return _find_gains(robot, entry_of(robot, law))


def default_gains_note(robot: Robot, law: str | None = None) -> str:
    """Note on a robot that drives with default gains; empty where it has a file; rest as in `gains_of`."""
    if gains_path(robot, law) is not None:
        return ""
    name = entry_of(robot, law).law.law
    return (
        f"no gains file: default gains of '{name}', computed from the limits of '{robot.name}'. "
        f"controllers/{robot.name}_{name}.yaml would take their place."
    )


def _find_gains(robot: Robot, entry: Entry) -> Path | None:
    """The file with a law's gains for a robot; None where it has none and the law has default gains."""
    name = f"{robot.name}_{entry.law.law}"
    if name in config_names("controllers"):
        return config_path("controllers", name)
    if entry.defaults is None:
        others = [each for each in config_names("controllers") if each.endswith(f"_{entry.law.law}")]
        raise ConfigError(
            f"no gains of '{entry.law.law}' for '{robot.name}'. Write configs/controllers/{name}.yaml, or "
            f"controllers/{name}.yaml beside robots/ of your own, as {config_path('controllers', others[0])} is."
        )
    return None
