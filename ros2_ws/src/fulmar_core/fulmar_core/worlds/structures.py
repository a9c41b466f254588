"""Things in space, as read from `configs/things/<name>.yaml`: parts with true sizes, a scale, and a keep-out volume.

A file names the source of each part's sizes, which are whole ones in true metres; `load_structure` scales them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names, config_path
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.worlds.structure_file import StructureFile, scaled_parts
from fulmar_core.worlds.structure_parts import (
    AT_THE_ORIGIN,
    SEMANTIC_IDS,
    KeepOut,
    Part,
    moved_part,
    xyzw,
)

__all__ = [
    "AT_THE_ORIGIN",
    "SEMANTIC_IDS",
    "KeepOut",
    "Part",
    "Structure",
    "list_structures",
    "load_structure",
    "xyzw",
]

FAMILY = "things"
KEEP_OUT, MARGIN = 1.2, 0.05  # least radius of a keep-out sphere, and beyond the farthest corner [half sizes]


@dataclass(frozen=True)
class Structure:
    """A thing in space, scaled, in its own frame, which is the world's unless it was moved with `at`."""

    name: str
    title: str
    parts: tuple[Part, ...]
    keep_out: KeepOut
    half_size: float  # half of the largest side of the box about it in its own frame [m]

    def at(self, pose: tuple[float, ...]) -> Structure:
        """It at another pose: x, y, z [m], then the quaternion w, x, y, z."""
        parts = tuple(moved_part(part, pose) for part in self.parts)
        return Structure(self.name, self.title, parts, self.keep_out.at(pose), self.half_size)


def list_structures() -> list[str]:
    """Names of all things in space, sorted."""
    return config_names(FAMILY)


def load_structure(name: str) -> Structure:
    """Read `configs/things/<name>.yaml` and scale it.

    Raises:
        ConfigError: Unknown name, a mistake in the file, two parts with one name, or a part outside of the keep-out
            volume.
    """
    path = config_path(FAMILY, name)
    file = load_config(StructureFile, path)
    parts = tuple(part for each in file.parts for part in scaled_parts(each, file.scale))
    names = [part.name for part in parts]
    twice = next((each for each in names if names.count(each) > 1), None)
    if twice:
        raise ConfigError(f"{path}: two parts are called '{twice}'. Give each a name of its own.")
    corners = np.concatenate([part.corners for part in parts])
    half = 0.5 * float(np.ptp(corners, axis=0).max())
    keep_out = (
        _sphere_about(corners, half) if file.keep_out is None else _scaled_volume(file.keep_out, file.scale)
    )
    nearest = max(parts, key=lambda part: float(keep_out.distance(part.corners).max()))
    if (beyond := float(keep_out.distance(nearest.corners).max())) > 0.0:
        raise ConfigError(
            f"{path}: part '{nearest.name}' reaches {beyond / file.scale:.2f} m out of 'keep_out'. Make that larger."
        )
    return Structure(name, file.title, parts, keep_out, half)


def _sphere_about(corners: np.ndarray, half: float) -> KeepOut:
    farthest = float(np.linalg.norm(corners, axis=1).max())
    origin = (0.0, 0.0, 0.0)
    return KeepOut(origin, origin, max(KEEP_OUT * half, farthest + MARGIN * half))


def _scaled_volume(volume: KeepOut, scale: float) -> KeepOut:
    (x, y, z), (u, v, w) = volume.start, volume.end
    start, end = (scale * x, scale * y, scale * z), (scale * u, scale * v, scale * w)
    return KeepOut(start, end, scale * volume.radius)
