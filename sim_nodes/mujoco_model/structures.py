"""Things in space in MuJoCo: fixed bodies that the robot's hull touches and that cameras see."""

from __future__ import annotations

import mujoco
import numpy as np

from fulmar_core.worlds.structures import SEMANTIC_IDS, Structure
from sim_nodes.mujoco_model.scenery import THING_BIT

SLICES, STACKS = (
    128,
    64,
)  # of round parts in images; with MuJoCo's own 28 and 16 depth is wrong by up to 4 %
SEPARATOR = "/"  # between the names of a structure and of its part in that of a geom
SHAPES = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
}


def add_structure(
    spec: mujoco.MjSpec, structure: Structure, *, touches: bool = True, group: int = 0
) -> mujoco.MjsBody:
    """Add a structure where it stands, one geom a part, called `<structure>/<part>`.

    Args:
        spec: Model under construction; its round geoms are drawn finely from then on.
        structure: At its pose in the world.
        touches: Whether the hull of a robot touches it; off for models that only show it.
        group: Of the geoms, 0 to 5, so that rays and images may leave them out.

    Returns:
        Its body, which does not move.
    """
    spec.visual.quality.numslices, spec.visual.quality.numstacks = SLICES, STACKS
    body = spec.worldbody.add_body(name=structure.name)
    bits = THING_BIT if touches else 0
    for part in structure.parts:
        body.add_geom(
            name=f"{structure.name}{SEPARATOR}{part.name}",
            type=SHAPES[part.shape],
            size=[*part.size, 0.0, 0.0][:3],
            pos=list(part.pose[:3]),
            quat=list(part.pose[3:]),
            rgba=[*part.color, 1.0],
            group=group,
            contype=bits,
            conaffinity=bits,
        )
    return body


def semantic_ids(model: mujoco.MjModel, structures: tuple[Structure, ...]) -> np.ndarray:
    """Semantic id of each geom of a compiled model, shape (ngeom,) uint16; 0 for what is no part of a structure."""
    ids = np.zeros(model.ngeom, dtype=np.uint16)
    for structure in structures:
        for part in structure.parts:
            ids[model.geom(f"{structure.name}{SEPARATOR}{part.name}").id] = SEMANTIC_IDS[part.semantic]
    return ids
