"""Write a new robot into a folder that FULMAR_CONFIGS may name."""

from __future__ import annotations

import os
from pathlib import Path

from fulmar_core.config.atomic_write import write_whole
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import OWN_FOLDERS, config_directory
from fulmar_core.robots.robot_file import load_robot_file
from fulmar_core.wires.robot_name import check_robot_name
from fulmar_evaluation.new_robot.new_robot import NewRobot

USUAL_FOLDER = Path("mine")


def usual_folder() -> Path:
    """The first folder of FULMAR_CONFIGS, else `mine`."""
    first = os.environ.get(OWN_FOLDERS, "").split(os.pathsep)[0]
    return Path(first) if first else USUAL_FOLDER


def check_new_name(name: str, folder: Path, *, replaces: bool = False) -> Path:
    """The file of a new robot.

    Raises:
        ConfigError: No robot can have the name, Fulmar comes with one of it, or the file is there and stays.
    """
    try:
        check_robot_name(name)
    except ValueError as error:
        raise ConfigError(str(error)) from error
    if (config_directory() / "robots" / f"{name}.yaml").exists():
        raise ConfigError(f"Fulmar comes with a robot '{name}'. Give yours another name, such as my_{name}.")
    path = folder / "robots" / f"{name}.yaml"
    if path.exists() and not replaces:
        raise ConfigError(f"{path} exists already; no file is overwritten. Give another name, or --force.")
    return path


def write_robot(new: NewRobot, path: Path) -> None:
    """Write the file, and the meshes beside it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    contents = {path: new.text.encode()}
    for beside, source in new.meshes.items():
        target = path.parent / beside
        target.parent.mkdir(parents=True, exist_ok=True)
        contents[target] = source.read_bytes()
    write_whole(contents)
    load_robot_file(path)  # warns of unusual values, with their lines
