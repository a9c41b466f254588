"""Files of meshes that a URDF or an MJCF names: where they are, and which of them are taken."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.mesh_file import SUFFIXES, read_mesh
from fulmar_evaluation.new_robot.description import Gap, Place, Solid

PACKAGE, FILE = "package://", "file://"


@dataclass
class Meshes:
    """Meshes of one file; what is not taken is a gap, once for each name."""

    source: Path
    _gaps: dict[str, Gap] = field(default_factory=dict)

    @property
    def gaps(self) -> tuple[Gap, ...]:
        """What was not taken."""
        return tuple(self._gaps.values())

    def solid(self, name: str, scale: np.ndarray, where: str, link: str, place: Place) -> Solid | None:
        """A mesh as a shape with its bounding box; None, and a gap, where it is not there or not read."""
        path = next((each for each in places_of(name, self.source) if each.is_file()), None)
        if path is None:
            self._gaps[name] = Gap(
                "look", f"{where} is the mesh {name}, which is not there", _where_to_put(name, self.source)
            )
            return None
        if path.suffix.lower() not in SUFFIXES:
            accepted = " or ".join(suffix[1:].upper() for suffix in SUFFIXES)
            self._gaps[name] = Gap("look", f"{where} is the mesh {name}", f"convert it to {accepted}")
            return None
        try:
            low, high = read_mesh(path.resolve()).span
        except ConfigError as error:
            self._gaps[name] = Gap("look", str(error))
            return None
        ends = np.sort(np.stack((low * scale, high * scale)), axis=0)
        x, y, z = (float(each) for each in scale)
        return Solid(
            shape="mesh",
            size=tuple(ends[1] - ends[0]),
            place=place,
            link=link,
            file=path.resolve(),
            scale=(x, y, z),
            middle=tuple(0.5 * (ends[0] + ends[1])),
        )


def places_of(name: str, source: Path) -> Iterator[Path]:
    """Where a mesh of a name may be, the likeliest first.

    A `package://` is looked for in the folders above the file, and in the packages of ROS_PACKAGE_PATH and
    AMENT_PREFIX_PATH.
    """
    if not name.startswith(PACKAGE):
        yield source.parent / name.removeprefix(FILE)
        return
    package, _, rest = name.removeprefix(PACKAGE).partition("/")
    for folder in source.resolve().parents:
        yield folder / package / rest
        yield folder / rest  # the package's folder has another name, or is this one
    for variable, below in (("ROS_PACKAGE_PATH", "."), ("AMENT_PREFIX_PATH", "share")):
        for prefix in filter(None, os.environ.get(variable, "").split(os.pathsep)):
            yield Path(prefix) / below / package / rest


def _where_to_put(name: str, source: Path) -> str:
    if not name.startswith(PACKAGE):
        return f"put it at {source.parent / name}"
    package = name.removeprefix(PACKAGE).partition("/")[0]
    return f"put the package '{package}' beside the file, or into ROS_PACKAGE_PATH"
