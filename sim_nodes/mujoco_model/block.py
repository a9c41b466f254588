"""A round thing to push: it stands on the floor by its weight, and slides by friction."""

from __future__ import annotations

import mujoco

from fulmar_core.dynamics.contact import Block
from sim_nodes.mujoco_model.obstacles import FAR
from sim_nodes.mujoco_model.surroundings import FLOOR_BIT, THING_BIT

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
