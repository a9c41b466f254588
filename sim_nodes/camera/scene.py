"""The model that a camera looks at: structures, ground, blocks that move, one sun; and the semantic id of each geom."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import mujoco
import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.dynamics.contact import Block
from fulmar_core.robots.sensors.camera import CameraConfig
from fulmar_core.states.rotation import multiply
from fulmar_core.worlds.structures import Structure
from sim_nodes.camera.backdrop import BLOCK_ID, Backdrop, Ground
from sim_nodes.mujoco_model.objects import COLOUR
from sim_nodes.mujoco_model.structures import SLICES, STACKS, add_structure, semantic_ids

BODY, CAMERA, GROUND = "base_link", "camera", "ground"
BACK = np.array([1.0, 0.0, 0.0, 0.0])  # MuJoCo's camera looks along -z, with y up: ROS's, turned about x
Blocks = Mapping[str, Block]  # by the names of their bodies


def seen_by(camera: CameraConfig, backdrop: Backdrop) -> CameraConfig:
    """The camera with the clip that its backdrop need."""
    return replace(camera, far=max(camera.far, backdrop.far))


def compiled(
    camera: CameraConfig, structures: Sequence[Structure], backdrop: Backdrop, blocks: Blocks
) -> tuple[mujoco.MjModel, np.ndarray]:
    """The model, and the semantic id of each of its geoms, shape (ngeom,).

    Raises:
        ConfigError: MuJoCo cannot build it.
    """
    spec = mujoco.MjSpec()
    for structure in structures:
        add_structure(spec, structure, touches=False)
    _set_image(spec, camera)
    _set_roundness(spec, structures)
    _add_light(spec, backdrop.sky)
    ground = backdrop.ground
    if ground is not None:
        _add_ground(spec, ground)
    for name, block in blocks.items():
        _add_block(spec, name, block, 0.0 if ground is None else ground.height)
    _add_camera(spec, camera)
    try:
        model = spec.compile()
    except ValueError as error:
        raise ConfigError(
            f"MuJoCo cannot build what the camera looks at: {' '.join(str(error).split())}"
        ) from None
    ids = semantic_ids(model, tuple(structures))
    ids[[model.geom(name).id for name in blocks]] = BLOCK_ID
    if ground is not None:
        ids[model.geom(GROUND).id] = ground.semantic
    return model, ids


def _set_image(spec: mujoco.MjSpec, camera: CameraConfig) -> None:
    """Size, clip and samples. The clip is given in multiples of the extent, which MuJoCo else finds by itself."""
    spec.stat.extent, spec.stat.center = 1.0, [0.0, 0.0, 0.0]
    visual = spec.visual
    visual.global_.offwidth, visual.global_.offheight = camera.width, camera.height
    visual.map.znear, visual.map.zfar = camera.near, camera.far
    visual.quality.offsamples = visual.quality.shadowsize = 0


def _set_roundness(spec: mujoco.MjSpec, structures: Sequence[Structure]) -> None:
    """Facets of round shapes. A cylinder needs them around it alone: along it, they cost ten times the time."""
    curved = any(part.shape in ("sphere", "capsule") for structure in structures for part in structure.parts)
    quality = spec.visual.quality
    # With one stack the ends of a cylinder are open.
    slices, stacks = (SLICES, STACKS) if curved else (2 * SLICES, 2)
    quality.numslices, quality.numstacks, quality.numquads = slices, stacks, 1


def _add_light(spec: mujoco.MjSpec, sky: bool) -> None:
    """One sun, far away, and some light from everywhere."""
    spec.visual.headlight.ambient = [0.35 if sky else 0.2] * 3
    spec.visual.headlight.diffuse = spec.visual.headlight.specular = [0.0] * 3
    kind = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    sun = spec.worldbody.add_light(name="sun", type=kind, dir=[-0.5, 0.6, -0.62], castshadow=False)
    sun.diffuse, sun.specular = [0.8] * 3, [0.1] * 3
    if sky:
        spec.add_texture(
            name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
            rgb1=[0.25, 0.45, 0.75], rgb2=[0.80, 0.88, 0.95], width=256, height=1536,
        )  # fmt: skip


def _add_ground(spec: mujoco.MjSpec, ground: Ground) -> None:
    texture = spec.add_texture(
        name=GROUND, type=mujoco.mjtTexture.mjTEXTURE_2D, builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=list(ground.color), rgb2=[0.85 * each for each in ground.color], width=64, height=64,
    )  # fmt: skip
    material = spec.add_material(name=GROUND, texrepeat=[0.5, 0.5], texuniform=True)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = texture.name
    spec.worldbody.add_geom(
        name=GROUND, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0.0, 0.0, 1.0], pos=[0.0, 0.0, ground.height],
        material=material.name,
    )  # fmt: skip


def _add_block(spec: mujoco.MjSpec, name: str, block: Block, floor: float) -> None:
    """Add a block that stands on the floor wherever its body is put at the height 0 [m]."""
    half = 0.5 * block.height
    body = spec.worldbody.add_body(name=name, mocap=True)
    body.add_geom(
        name=name, type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[block.radius, half, 0.0],
        pos=[0.0, 0.0, floor + half], rgba=COLOUR,
    )  # fmt: skip


def _add_camera(spec: mujoco.MjSpec, camera: CameraConfig) -> None:
    x, y, z, w = multiply(np.array(camera.optical_quat_xyzw), BACK)
    body = spec.worldbody.add_body(name=BODY, mocap=True)
    position, fovy = list(camera.position), camera.vertical_field_of_view
    body.add_camera(name=CAMERA, pos=position, quat=[w, x, y, z], fovy=fovy)
