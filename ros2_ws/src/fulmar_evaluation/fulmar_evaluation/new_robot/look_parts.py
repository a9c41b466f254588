"""The `look` of a robot's file from the shapes that a URDF or an MJCF draws."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from fulmar_core.robots.look import COLORS, MOST_PARTS
from fulmar_core.states.attitude import euler_of
from fulmar_evaluation.new_robot.description import Description, Gap, Solid

MILLIMETRES, DEGREES = 5, 4  # digits
FOLDER = "meshes"


@dataclass
class LookParts:
    """Parts of `look`, what was not taken, and the files to copy, by their path beside the robot's file."""

    parts: list[dict[str, object]]
    gaps: list[Gap]
    meshes: dict[str, Path]


def look_of_solids(description: Description, name: str) -> LookParts:
    """The look of a new robot of a name."""
    solids, gaps = description.visuals, []
    if len(solids) > MOST_PARTS:
        gaps.append(
            Gap("look", f"{len(solids)} shapes are drawn, the first {MOST_PARTS} were taken", "choose others")
        )
    taken = solids[:MOST_PARTS]
    beside = _beside({solid.file for solid in taken if solid.file is not None}, name)
    parts = [_part(solid, beside) for solid in taken]
    return LookParts(parts, gaps, {place: file for file, place in beside.items()})


def _beside(files: set[Path], name: str) -> dict[Path, str]:
    """Where copies of meshes are, beside the robot's file; two of one name get numbers."""
    found: dict[Path, str] = {}
    for file in sorted(files):
        same = sum(other.name == file.name for other in found)
        stem = f"{file.stem}_{same + 1}" if same else file.stem
        found[file] = f"{FOLDER}/{name}/{stem}{file.suffix.lower()}"
    return found


def _part(solid: Solid, beside: Mapping[Path, str]) -> dict[str, object]:
    part: dict[str, object] = {"shape": solid.shape}
    if solid.file is not None:
        part |= {"file": beside[solid.file], "scale": list(solid.scale)}
    else:
        part["size"] = [round(float(each), MILLIMETRES) for each in solid.size]
    at = [round(float(each), MILLIMETRES) for each in solid.place.position]
    turn = euler_of(Rotation.from_matrix(solid.place.rotation).as_quat().tolist())
    rpy = [round(math.degrees(each), DEGREES) for each in turn]
    if any(at):
        part["at"] = at
    if any(rpy):
        part["rpy"] = rpy
    if solid.rgba is not None:
        part["color"] = nearest_color(solid.rgba)
    return part


def nearest_color(rgba: tuple[float, ...]) -> str:
    """Name of the colour of `look` that is nearest to red, green, blue, opacity, each 0 to 1."""
    names = [name for name in COLORS if name != "own"]
    far = [float(np.linalg.norm(np.array(COLORS[name]) - np.array(rgba))) for name in names]
    return names[int(np.argmin(far))]
