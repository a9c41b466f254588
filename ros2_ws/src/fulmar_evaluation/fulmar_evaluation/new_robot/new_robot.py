"""Make a robot's file from a robot that it is like, a URDF or an MJCF, and values that a user sets."""

from __future__ import annotations

import logging
import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_path
from fulmar_core.config.plausibility import logger as plausibility
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.config.yaml_text import load
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot_file
from fulmar_evaluation.new_robot.comments import Comments
from fulmar_evaluation.new_robot.derived import scale_parts, scale_performance
from fulmar_evaluation.new_robot.description import NAME_THEM, Description, Gap
from fulmar_evaluation.new_robot.measuring import measuring_steps
from fulmar_evaluation.new_robot.robot_text import robot_text
from fulmar_evaluation.new_robot.settings import OPTION, apply_settings
from fulmar_evaluation.new_robot.taken_keys import take_description

ABOUT_BODY = ("body", "actuators", "hydrodynamics")  # what performance and spans follow from


@dataclass
class NewRobot:
    """A robot's file that is not written yet.

    Attributes:
        name: Of the robot.
        text: Content of the file; it loads.
        robot: As read.
        gaps: What was not taken from a URDF or an MJCF.
        steps: What to measure with which command, one line each.
        meshes: Files of meshes to copy, by their path beside the robot's file.
    """

    name: str
    text: str
    robot: Robot
    gaps: tuple[Gap, ...] = ()
    steps: tuple[str, ...] = ()
    meshes: dict[str, Path] = field(default_factory=dict)

    @property
    def unnamed(self) -> str:
        """What to ask a person for: names of what moves it, where none was found; empty where some were."""
        lacking = any(NAME_THEM in gap.write for gap in self.gaps)
        return "Which links, sites or joints of the file move it?" if lacking else ""


def make_robot(
    name: str,
    like: str,
    settings: Mapping[str, Any] | None = None,
    description: Description | None = None,
    actuators: Sequence[str] = (),
) -> NewRobot:
    """Make the file of a robot.

    Args:
        name: Of the new robot.
        like: Name of a robot of the same family; what nothing else says is that robot's.
        settings: Values by dotted key, which count more than all others.
        description: What a URDF or an MJCF says; None: there is none.
        actuators: Names in it of what moves the robot; empty: by the words of the family.

    Raises:
        ConfigError: There is no such robot, a key is unknown, or no robot can have these values.
    """
    settings = settings or {}
    other = load_robot_file(config_path("robots", like))
    robot: dict[str, Any] = load(config_path("robots", like).read_text(encoding="utf-8"))
    robot |= {"name": name, "title": f"{name}, like {like}"}
    origins = dict.fromkeys(("body", "actuators", "sensors", "timing", "costs", "limits"), f"as {like}")
    gaps: list[Gap] = []
    meshes: dict[str, Path] = {}
    if description is not None:
        robot["title"] = f"{name}, from {description.source.name}"
        taken = take_description(robot, other, description, actuators, settings)
        origins |= dict.fromkeys(taken.keys, f"from {description.source.name}")
        gaps += taken.gaps
        meshes = taken.meshes
    apply_settings(robot, settings)
    origins |= dict.fromkeys(settings, "as you set it")
    given = {key for key, origin in origins.items() if origin != f"as {like}"}
    if any(key.split(".")[0] in ABOUT_BODY for key in given):
        _follow(robot, other, given, origins)
    _drop_foreign_parts(robot, other, changed="actuators" in {key.split(".")[0] for key in given})
    found = _read(robot, load_robot_file, meshes)
    steps = measuring_steps(found)
    head = [
        f"{name}: made by `fulmar new robot {name} --like {like}`"
        + (f" from {description.source.name}." if description is not None else "."),
        "Every value has to be your robot's; what to measure, in this order:",
        *(f"  {number}. {step}" for number, step in enumerate(steps, 1)),
        *(["Not taken from the file:", *(f"  - {gap}" for gap in gaps)] if gaps else []),
    ]
    text = robot_text(robot, head, Comments(found, origins))
    return NewRobot(name, text, found, tuple(gaps), steps, meshes)


def _follow(robot: dict[str, Any], like: Robot, given: set[str], origins: dict[str, str]) -> None:
    """Scale what follows from the body, then what follows from the actuators."""
    robot.pop("morphology", None)  # of the other's bodies
    try:
        scaled = scale_parts(robot, like, given)
    except (TypeError, LookupError, ZeroDivisionError):
        _read(robot, _strictly)  # a value of the wrong type: the loader says which
        raise
    origins |= dict.fromkeys(scaled, f"scaled from {like.name}'s")
    trial = _read(robot, _strictly)
    computed = scale_performance(robot, trial, like, given)
    origins |= dict.fromkeys(computed, "computed from actuators and body")


def _drop_foreign_parts(robot: dict[str, Any], like: Robot, *, changed: bool) -> None:
    """Leave out what is about another robot: what its actuators move in its look."""
    if not changed or "look" not in robot:
        return
    names = {
        part.get("name")
        for value in robot["actuators"].values()
        if isinstance(value, list)
        for part in value
        if isinstance(part, dict)
    }
    kept = names or like.actuators.names
    for part in robot["look"]:
        if part.get("moves") and part["moves"] not in kept:
            for key in ("moves", "about", "gain"):
                part.pop(key, None)


@contextmanager
def _without_warnings() -> Iterator[None]:
    """Leave warnings about unusual values to the file that is written, whose lines they name."""
    level = plausibility.level
    plausibility.setLevel(logging.ERROR)
    try:
        yield
    finally:
        plausibility.setLevel(level)


def _strictly(path: Path) -> Robot:
    return load_config(Robot, path)


def _read(robot: dict[str, Any], loader: Any, meshes: Mapping[str, Path] | None = None) -> Robot:
    """Read a robot's keys as a file, with its meshes beside it.

    Raises:
        ConfigError: No robot can have them.
    """
    with tempfile.TemporaryDirectory(prefix="fulmar-") as folder:
        trial = Path(folder) / f"{robot['name']}.yaml"
        for place, file in (meshes or {}).items():
            beside = Path(folder) / place
            beside.parent.mkdir(parents=True, exist_ok=True)
            beside.symlink_to(file)
        trial.write_text(robot_text(robot, [], lambda _: ""), encoding="utf-8")
        try:
            with _without_warnings():
                found: Robot = loader(trial)
        except ConfigError as error:
            said = re.sub(rf"{re.escape(str(trial))}(:\d+)?: ", "", str(error))
            raise ConfigError(f"{robot['name']}: {said} Give what is right by {OPTION} KEY=VALUE.") from error
    return found
