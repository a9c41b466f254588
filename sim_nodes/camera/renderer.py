"""What a camera sees: colours, depth and semantic ids from the pose of its body, drawn by MuJoCo without a step."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import mujoco
import numpy as np

from fulmar_core.robots.sensors.camera import CameraConfig
from fulmar_core.worlds.structures import Structure
from sim_nodes.camera.backdrop import SPACE, Backdrop
from sim_nodes.camera.opengl import context, find_platform
from sim_nodes.camera.scene import BODY, CAMERA, Blocks, compiled, seen_by

SEGMENT = mujoco.mjtRndFlag.mjRND_SEGMENT, mujoco.mjtRndFlag.mjRND_IDCOLOR
WITHOUT = mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION, mujoco.mjtRndFlag.mjRND_FOG
OFFSCREEN = mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value
EVERYTHING = mujoco.mjtCatBit.mjCAT_ALL.value


@dataclass(frozen=True)
class Frames:
    """Three images of one view, with the first row on top and the same pixels."""

    rgb: np.ndarray  # red, green, blue, uint8 (h, w, 3)
    depth: np.ndarray  # along the optical axis, infinity where nothing is, float32 (h, w) [m]
    segmentation: np.ndarray  # semantic id, 0 where nothing is, uint16 (h, w)


class Renderer:
    """One camera in one scene. It belongs to the thread that made it, and is to be closed."""

    def __init__(
        self,
        camera: CameraConfig,
        structures: Sequence[Structure] = (),
        *,
        backdrop: Backdrop = SPACE,
        blocks: Blocks | None = None,
        platform: str = "",
    ) -> None:
        """Build the scene and get ready to draw.

        Args:
            camera: What the robot's file says of it.
            structures: To see, where they stand in the world.
            backdrop: What else there is; see `backdrop_of`.
            blocks: That move, by name.
            platform: egl or osmesa; empty: as `opengl.find_platform` finds.

        Raises:
            ConfigError: Nothing can draw here, or MuJoCo cannot build the scene.
        """
        self.camera = camera = seen_by(camera, backdrop)
        self.model, self._ids = compiled(camera, structures, backdrop, blocks or {})
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self._cleanup = contextlib.ExitStack()
        self._context = self._cleanup.enter_context(
            context(platform or find_platform(), camera.width, camera.height)
        )
        self._drawing = mujoco.MjrContext(self.model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        self._cleanup.callback(self._drawing.free)
        mujoco.mjr_setBuffer(OFFSCREEN, self._drawing)
        self._drawing.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        self._rect = mujoco.MjrRect(0, 0, camera.width, camera.height)
        self._scene = mujoco.MjvScene(self.model, maxgeom=max(100, 2 * self.model.ngeom))
        for flag in WITHOUT:
            self._scene.flags[flag] = False
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SKYBOX] = backdrop.sky
        self._option, self._eye = mujoco.MjvOption(), mujoco.MjvCamera()
        self._eye.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._eye.fixedcamid = self.model.camera(CAMERA).id
        self._table: np.ndarray | None = None  # semantic id by the number that a segmented pixel has
        self._pixels = np.empty((camera.height, camera.width, 3), dtype=np.uint8)
        self._nearness = np.empty((camera.height, camera.width), dtype=np.float32)

    def render(self, pose: np.ndarray, blocks: Mapping[str, np.ndarray] | None = None) -> Frames:
        """What the camera sees.

        Args:
            pose: Of the robot's body in the world: x, y, z [m], quaternion x, y, z, w, shape (7,).
            blocks: Poses of the same form of blocks, by name; the others stay where they were.
        """
        self._place(BODY, pose)
        for name, of in (blocks or {}).items():
            self._place(name, of)
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)
        mujoco.mjv_updateScene(self.model, self.data, self._option, None, self._eye, EVERYTHING, self._scene)
        self._context.make_current()
        mujoco.mjr_render(self._rect, self._scene, self._drawing)
        mujoco.mjr_readPixels(self._pixels, None, self._rect, self._drawing)
        rgb = self._pixels[::-1].copy()
        for flag in SEGMENT:
            self._scene.flags[flag] = True
        mujoco.mjr_render(self._rect, self._scene, self._drawing)
        mujoco.mjr_readPixels(self._pixels, self._nearness, self._rect, self._drawing)
        for flag in SEGMENT:
            self._scene.flags[flag] = False
        digits, nearness = self._pixels[::-1].astype(np.uint32), self._nearness[::-1]
        number = digits[..., 0] | digits[..., 1] << 8 | digits[..., 2] << 16
        return Frames(rgb, self._depth_of(nearness, number > 0), self._semantic()[number])

    def close(self) -> None:
        """Free what the driver holds; OSMesa prints a traceback at the end of a process otherwise."""
        self._cleanup.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _place(self, name: str, pose: np.ndarray) -> None:
        number = self.model.body(name).mocapid[0]
        x, y, z, qx, qy, qz, qw = np.asarray(pose, dtype=float)
        self.data.mocap_pos[number], self.data.mocap_quat[number] = (x, y, z), (qw, qx, qy, qz)

    def _depth_of(self, nearness: np.ndarray, there: np.ndarray) -> np.ndarray:
        """Depth [m] of a reversed depth buffer: 1 at the near plane, 0 at the far one."""
        near, far = np.float32(self.camera.near), np.float32(self.camera.far)
        depth = np.full(nearness.shape, np.inf, dtype=np.float32)
        # As the projection matrix has it, whose entries are of single precision; undone in double precision.
        slope = np.float32(0.5) * (far + near) / (far - near) - np.float32(0.5)
        offset = far * near / (far - near)
        depth[there] = float(offset) / (nearness[there].astype(np.float64) + float(slope))
        return depth

    def _semantic(self) -> np.ndarray:
        """Semantic id by the number of a segmented pixel; the order of a scene's shapes stays."""
        if self._table is None:
            self._table = np.zeros(self._scene.ngeom + 1, dtype=np.uint16)
            for geom in self._scene.geoms[: self._scene.ngeom]:
                if geom.segid >= 0 and geom.objtype == mujoco.mjtObj.mjOBJ_GEOM:
                    self._table[geom.segid + 1] = self._ids[geom.objid]
        return self._table
