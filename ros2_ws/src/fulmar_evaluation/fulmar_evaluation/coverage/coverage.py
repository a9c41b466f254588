"""Coverage: the share of a thing's outer surface that a camera has seen, at no more than 60° from its normal.

A sample of the surface counts once it was in view, faced the camera, and nothing lay between. What lies between is
found exactly, by rays, or as a robot finds it, from the depth and the segmentation of its images.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from fulmar_core.robots.sensors.camera import CameraConfig
from fulmar_core.states.rotation import rotate_inverse
from fulmar_core.worlds.structures import SEMANTIC_IDS, Structure
from fulmar_evaluation.coverage.surface import Surface, surface_of
from sim_nodes.camera.opengl import check_loadable

STEEPEST_DEG = 60.0  # between the normal of a surface and the way to the camera
SAME_DEPTH = 0.03  # by which the depth of a pixel may differ from that of a sample in it [-]
SAME_POINT = 1e-3  # by which a ray may end before the sample that it is sent to [-]
EVERY_S = 1.0  # a pose each second is enough: neighbours see the same


@dataclass(frozen=True)
class Coverage:
    """What a camera has seen of a thing.

    Attributes:
        share: Of its outer surface, that was seen in the images [-].
        visible: Of its outer surface, that could be seen from the same places by looking everywhere [-].
        seen: Whether each sample of the surface was, shape (n,).
    """

    share: float
    visible: float
    seen: np.ndarray


def coverage(structure: Structure, poses: np.ndarray, camera: CameraConfig) -> Coverage:
    """What a camera has seen along a path, by exact rays.

    Args:
        structure: Where it stands in the world.
        poses: Of the body in the world: x, y, z [m], quaternion x, y, z, w, shape (n, 7); see `EVERY_S`.
        camera: Of the robot.
    """
    surface = surface_of(structure)
    cast = _rays_of(structure)
    could, seen = np.zeros((2, len(surface.points)), dtype=bool)
    for eye, local in _views(surface, poses, camera):
        facing = _faces(surface, eye)
        viewed = facing & _in_view(local, camera)
        ask = np.flatnonzero((facing & ~could) | (viewed & ~seen))
        free = ask[cast.reach(eye, surface.points[ask])]
        could[free] = True
        seen[free[viewed[free]]] = True
    return Coverage(float(seen.mean()), float(could.mean()), seen)


def coverage_of_images(structure: Structure, poses: np.ndarray, camera: CameraConfig) -> Coverage:
    """The same from images that are drawn at these poses; `visible` is then `share`, since nothing else is known.

    Raises:
        ConfigError: Nothing can draw here.
    """
    from sim_nodes.camera.renderer import Renderer

    surface = surface_of(structure)
    ids = np.array([SEMANTIC_IDS[part.semantic] for part in structure.parts])[surface.parts]
    seen = np.zeros(len(surface.points), dtype=bool)
    with Renderer(camera, [structure]) as renderer:
        for pose, (eye, local) in zip(poses, _views(surface, poses, camera), strict=True):
            frames = renderer.render(pose)
            viewed = np.flatnonzero(_faces(surface, eye) & _in_view(local, camera) & ~seen)
            row, column = pixels(local[viewed], camera)
            depth = frames.depth[row, column]
            alike = np.abs(depth - local[viewed, 2]) < SAME_DEPTH * local[viewed, 2]
            seen[viewed[alike & (frames.segmentation[row, column] == ids[viewed])]] = True
    return Coverage(float(seen.mean()), float(seen.mean()), seen)


def pixels(local: np.ndarray, camera: CameraConfig) -> tuple[np.ndarray, np.ndarray]:
    """Row and column of points of the optical frame that are in view, shape (n, 3) [m]."""
    across = camera.focal_px * local[:, 0] / local[:, 2] + 0.5 * camera.width
    down = camera.focal_px * local[:, 1] / local[:, 2] + 0.5 * camera.height
    row = down.astype(int).clip(0, camera.height - 1)
    return row, across.astype(int).clip(0, camera.width - 1)


def _views(
    surface: Surface, poses: Iterable[np.ndarray], camera: CameraConfig
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Place of the camera, and the samples in its optical frame, (n, 3) [m], of one pose after another."""
    for pose in poses:
        optical = camera.optical_pose(pose)
        yield optical[:3], rotate_inverse(optical[3:], surface.points - optical[:3])


def _faces(surface: Surface, eye: np.ndarray) -> np.ndarray:
    """Which samples face a place, shape (n,)."""
    way = eye - surface.points
    cosine = np.sum(way * surface.normals, axis=1) / np.maximum(np.linalg.norm(way, axis=1), 1e-9)
    return np.asarray(cosine >= math.cos(math.radians(STEEPEST_DEG)))


def _in_view(local: np.ndarray, camera: CameraConfig) -> np.ndarray:
    """Which points of the optical frame are in the image, shape (n,)."""
    x, y, z = local.T
    wide, high = (0.5 * side / camera.focal_px * z for side in (camera.width, camera.height))
    return np.asarray((z > camera.near) & (z < camera.far) & (np.abs(x) <= wide) & (np.abs(y) <= high))


@functools.cache
def _rays_of(structure: Structure) -> _Rays:
    return _Rays(structure)


class _Rays:
    """Rays among the parts of a structure."""

    def __init__(self, structure: Structure) -> None:
        check_loadable()
        import mujoco

        from sim_nodes.mujoco_model.structures import add_structure

        spec = mujoco.MjSpec()
        add_structure(spec, structure, touches=False)
        self._mujoco, self._model = mujoco, spec.compile()
        self._data = mujoco.MjData(self._model)
        mujoco.mj_forward(self._model, self._data)

    def reach(self, eye: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Which points (n, 3) nothing hides from a place, shape (n,)."""
        count = len(points)
        if not count:
            return np.zeros(0, dtype=bool)
        way = points - eye
        length = np.linalg.norm(way, axis=1)
        hit, distance = np.empty(count, dtype=np.int32), np.empty(count)
        self._mujoco.mj_multiRay(
            self._model, self._data, eye, (way / length[:, None]).ravel(), None, True, -1, hit, distance, None,
            count, 1e3,
        )  # fmt: skip
        return np.asarray((distance < 0.0) | (distance >= length * (1.0 - SAME_POINT)))
