"""Files that a robot's look names: found beside the robot's own file, and left out where a bag has no copies."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.strict_yaml import line_of
from fulmar_core.config.yaml_text import YamlError, dump, load
from fulmar_core.robots.look import Part
from fulmar_core.robots.mesh_file import check_mesh_file

MESH = "mesh"


def with_mesh_files(parts: tuple[Part, ...], path: Path) -> tuple[Part, ...]:
    """The same look with the whole paths of its meshes.

    Args:
        parts: As the file has them.
        path: Of the robot's file.

    Raises:
        ConfigError: A mesh is missing or of another format; the message has the line and the mesh's path.
    """
    if not any(part.file for part in parts):
        return parts
    found = []
    for number, part in enumerate(parts):
        if part.file:
            file = path.parent / part.file
            try:
                check_mesh_file(file)
            except ConfigError as error:
                line = line_of(path, ("look", str(number), "file"))
                raise ConfigError(f"{path}:{line}: 'look.{number}.file': {error}") from error
            part = replace(part, file=str(file.resolve()))
        found.append(part)
    return tuple(found)


def without_mesh_files(text: bytes) -> bytes:
    """A robot's file without the meshes of its look, for a place that has no copies; others stay byte for byte."""
    try:
        robot: Any = load(text.decode("utf-8"))
    except (YamlError, UnicodeDecodeError):
        return text  # its reader says what is wrong
    look = robot.get("look") if isinstance(robot, dict) else None
    if not isinstance(look, list):
        return text
    kept = [part for part in look if not (isinstance(part, dict) and part.get("shape") == MESH)]
    if len(kept) == len(look):
        return text
    return dump(
        {key: value for key, value in robot.items() if key != "look"} | ({"look": kept} if kept else {})
    ).encode()
