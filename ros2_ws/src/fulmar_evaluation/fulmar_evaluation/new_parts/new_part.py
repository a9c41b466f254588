"""Write a class of a user's own: the files of its page under another name."""

from __future__ import annotations

import keyword
import re
import sys
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from fulmar_core.config.atomic_write import write_whole
from fulmar_core.config.errors import ConfigError, UnknownNameError

SUFFIX = ".txt"  # of the templates, which no linter and no test runner takes for code
_NAME = re.compile(r"[a-z][a-z0-9_]{0,63}")


@dataclass(frozen=True)
class Part:
    """One kind of class.

    Attributes:
        module: Name of the module on its page.
        cls: Name of the class there.
        page: Of the documentation.
        files: Templates, the first one that of the class.
        then: Commands that use it, `{module}` and `{cls}` standing for its names.
    """

    module: str
    cls: str
    page: str
    files: tuple[str, ...]
    then: tuple[str, ...]


PARTS: dict[str, Part] = {
    "task": Part(
        "my_task",
        "Circle",
        "own-task.md",
        ("my_task.py", "test_my_task.py"),
        ("fulmar train turtlebot2 {module}:{cls} --time-limit 60 --out trained",),
    ),
    "controller": Part(
        "my_control",
        "Steer",
        "own-controller.md",
        ("my_control.py", "test_my_control.py"),
        (
            "fulmar evaluate turtlebot2 go_to_position --controller {module}:{cls} --through mujoco --episodes 64",
            "fulmar run turtlebot2 --task go_to_position --controller {module}:{cls} --lockstep",
        ),
    ),
    "driver": Part(
        "relay_board",
        "RelayBoard",
        "own-driver.md",
        ("relay_board.py", "relay_board.yaml", "test_relay_board.py"),
        (
            "fulmar doctor --for hardware {module}.yaml",
            "fulmar run floating_platform --backend hardware --hardware {module}.yaml --goal 0.5,0",
        ),
    ),
    "estimator": Part(
        "my_estimate",
        "MeanPose",
        "own-estimator.md",
        ("my_estimate.py", "test_my_estimate.py"),
        ("fulmar run floating_platform --controller lqr --estimator {module}:{cls} --lockstep",),
    ),
    "sensor": Part(
        "my_sensor",
        "WallRange",
        "own-sensor.md",
        ("my_sensor.py", "test_my_sensor.py"),
        ("below `sensors` of your robot write: own: {{front: {{sensor: '{module}:{cls}'}}}}",),
    ),
}


@dataclass(frozen=True)
class NewPart:
    """Files of one class, not written yet."""

    files: dict[Path, str]
    path: str  # `module:Class`
    then: tuple[str, ...]  # what to do next
    page: str


def template(name: str) -> str:
    """Text of a template, as its page has it."""
    return (resources.files(__package__) / "templates" / f"{name}{SUFFIX}").read_text(encoding="utf-8")


def make_part(kind: str, name: str, folder: Path) -> NewPart:
    """The files of a class.

    Args:
        kind: Key of `PARTS`.
        name: Of the module; the class has the same in capitals.
        folder: To write into.

    Raises:
        UnknownNameError: There is no such kind.
        ConfigError: No module can have the name, or a file exists already.
    """
    if kind not in PARTS:
        raise UnknownNameError("part", kind, PARTS)
    part, cls = PARTS[kind], _class_of(name)
    files = {}
    for each in part.files:
        text = re.sub(rf"\b{part.cls}\b", cls, template(each))
        text = re.sub(rf"\b((?:test_)?){part.module}\b", rf"\g<1>{name}", text)
        files[folder / each.replace(part.module, name)] = text
    there = next((path for path in files if path.exists()), None)
    if there is not None:
        raise ConfigError(f"{there} exists already; no file is overwritten. Take another name or --out.")
    test = next(path for path in files if path.name.startswith("test_"))
    steps = (f"python -m pytest {test.name}", *part.then)
    then = tuple(step.format(module=name, cls=cls) for step in steps)
    return NewPart(files, f"{name}:{cls}", then, part.page)


def write_part(new: NewPart) -> None:
    """Write the files."""
    for path in new.files:
        path.parent.mkdir(parents=True, exist_ok=True)
    write_whole({path: text.encode() for path, text in new.files.items()})


def _class_of(name: str) -> str:
    """Name of the class of a module: `dock_gate` has `DockGate`."""
    if not _NAME.fullmatch(name) or keyword.iskeyword(name) or name in sys.stdlib_module_names:
        raise ConfigError(
            f"the name '{name}' of a module must begin with a small letter, have only small letters, digits and "
            "underscores, 64 at most, and be none of Python's own. Example: dock_gate"
        )
    return "".join(word.capitalize() for word in name.split("_"))
