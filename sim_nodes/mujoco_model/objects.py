"""Obstacles (fixed upright cylinders) and blocks to push, placed anew for every episode."""

from __future__ import annotations

import mujoco
import numpy as np

from fulmar_core.dynamics.contact import Block
from sim_nodes.mujoco_model.scenery import FLOOR_BIT, THING_BIT

HEIGHT = 1.0  # higher than any robot [m]
FAR = 1000.0  # place of obstacles that an episode does not use [m]


def radii_for(obstacles: np.ndarray) -> tuple[float, ...]:
    """Radii to make room for.

    Args:
        obstacles: x [m], y [m] and radius [m], shape (m, 3 or more); radius 0 for none.

    Returns:
        One radius for each row, that of the largest where there is none [m]; nothing where there is none at all.
    """
    radii = obstacles[:, 2]
    if not np.any(radii > 0.0):
        return ()
    return tuple(float(r) for r in np.where(radii > 0.0, radii, radii.max()))


def has_room(radii: tuple[float, ...], obstacles: np.ndarray) -> bool:
    """Whether a model with cylinders of these radii can show these obstacles, row by row."""
    here = obstacles[:, 2]
    if not np.any(here > 0.0):
        return True
    return len(here) <= len(radii) and bool(np.all((here == 0.0) | (here == radii[: len(here)])))


def add_obstacles(spec: mujoco.MjSpec, radii: tuple[float, ...]) -> None:
    """Add one cylinder for each radius [m], far away."""
    for i, radius in enumerate(radii):
        body = spec.worldbody.add_body(name=_name(i), mocap=True, pos=[FAR + 10.0 * i, 0.0, 0.0])
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            size=[radius, 0.5 * HEIGHT, 0.0],
            rgba=[0.8, 0.35, 0.25, 1.0],
            contype=THING_BIT,
            conaffinity=THING_BIT,
        )


def place_obstacles(model: mujoco.MjModel, data: mujoco.MjData, obstacles: np.ndarray) -> None:
    """Move cylinders into place; `data` has just been reset, which leaves all of them far away."""
    for i, (x, y, radius) in enumerate(obstacles[:, :3]):
        if radius > 0.0:
            data.mocap_pos[model.body(_name(i)).mocapid[0]] = (x, y, 0.0)


def _name(i: int) -> str:
    return f"obstacle_{i + 1}"


COLOUR = [0.9, 0.7, 0.3, 1.0]
FOOT = 0.02  # height of the part that touches the floor [m]


def add_block(spec: mujoco.MjSpec, name: str, block: Block) -> None:
    """Add a block, standing on the floor far away."""
    half = 0.5 * block.height
    body = spec.worldbody.add_body(name=name, pos=[0.0, FAR, half])
    body.add_freejoint(name=name)
    cylinder = mujoco.mjtGeom.mjGEOM_CYLINDER
    body.add_geom(
        name=name,
        type=cylinder,
        size=[block.radius, half, 0.0],
        mass=block.mass,
        rgba=COLOUR,
        friction=[block.grip, 0.0, 0.0],
        priority=1,
        contype=THING_BIT,
        conaffinity=THING_BIT,
    )
    body.add_geom(
        type=cylinder,
        size=[block.radius, 0.5 * FOOT, 0.0],
        pos=[0.0, 0.0, 0.5 * FOOT - half],
        mass=0.0,
        rgba=COLOUR,
        friction=[block.floor_friction, 0.0, 0.0],
        priority=1,
        contype=FLOOR_BIT,
        conaffinity=0,
    )


def place_block(model: mujoco.MjModel, data: mujoco.MjData, name: str, x: float, y: float) -> None:
    """Put a block somewhere; `data` has just been reset, which leaves it upright and at rest."""
    start = model.joint(name).qposadr[0]
    data.qpos[start : start + 2] = x, y
