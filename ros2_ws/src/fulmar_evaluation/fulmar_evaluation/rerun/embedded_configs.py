"""Robots, tasks, scenarios and the calibration that a bag embeds."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from fulmar_bags.contents import Bag, open_bag
from fulmar_bringup.bag_origin import CALIBRATION
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import OWN_FOLDERS, config_names
from fulmar_core.config.process import environment
from fulmar_core.controllers.classical import entry_of
from fulmar_core.robots.calibration import VARIABLE
from fulmar_core.robots.look_files import without_mesh_files
from fulmar_core.robots.robot_file import load_robot
from policy_server.controllers import FALLBACKS

FAMILIES = {
    "robot": "robots",
    "task": "tasks",
    "scenario": "scenarios",
    "thing": "things",
}  # by what the record of a run calls it


@contextlib.contextmanager
def knowing_what_it_carries(*bags: Bag) -> Iterator[None]:
    """Find names that only bags know in the files that they carry, here and in children; known ones stay."""
    with tempfile.TemporaryDirectory(prefix="fulmar_carried_") as scratch:
        missing = [(bag, *each) for bag in bags for each in unknown(bag.info or {})]
        for bag, family, name in missing:
            carried = bag.attachments.get(f"{family.removesuffix('s')}.yaml")
            if carried is not None:
                path = Path(scratch) / family / f"{name}.yaml"
                path.parent.mkdir(exist_ok=True)
                path.write_bytes(without_mesh_files(carried) if family == "robots" else carried)
        folders = [os.environ.get(OWN_FOLDERS, ""), *([scratch] if os.listdir(scratch) else [])]
        with environment({OWN_FOLDERS: os.pathsep.join(filter(None, folders))}):
            for bag, family, name in missing:
                if family == "robots":
                    _write_gains(bag, name, Path(scratch) / "controllers")
            yield


def _write_gains(bag: Bag, robot: str, folder: Path) -> None:
    """Write the gains that a bag carries into the file that the robot's law reads; without it, it has default gains."""
    gains, controller = bag.attachments.get("controller.yaml"), str((bag.info or {}).get("controller"))
    if gains is None or controller not in FALLBACKS:
        return
    with contextlib.suppress(ConfigError):  # a robot that does not load is refused by who asks for it
        law = entry_of(load_robot(robot), controller).law.law
        folder.mkdir(exist_ok=True)
        (folder / f"{robot}_{law}.yaml").write_bytes(gains)


def unknown(info: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Families and names in the record of a run that nobody knows here; no name is a path."""
    asked = [(family, info.get(key)) for key, family in FAMILIES.items()]
    return [
        (family, name)
        for family, name in asked
        if isinstance(name, str) and name and name == Path(name).name and name not in config_names(family)
    ]


@contextlib.contextmanager
def knowing_what_they_carry(bags: Mapping[Path, Mapping[str, Any]]) -> Iterator[None]:
    """The same for bags that are not open, by their records; only those with something unknown are opened."""
    with knowing_what_it_carries(*(open_bag(path) for path, info in bags.items() if unknown(info))):
        yield


@contextlib.contextmanager
def calibrated_as(bag: Bag) -> Iterator[None]:
    """Load robots, here and in children, with the calibration that a bag carries along, or with none if it has none."""
    with tempfile.TemporaryDirectory(prefix="fulmar_calibration_") as scratch:
        path = Path(scratch) / CALIBRATION
        carried = bag.attachments.get(CALIBRATION)
        if carried is not None:
            path.write_bytes(carried)
        with environment({VARIABLE: str(path) if carried is not None else ""}):
            yield
