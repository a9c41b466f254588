"""What the models of bodies on a free joint have in common."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from fulmar_core.dynamics.rigid_body import matrix_of
from fulmar_core.states.spatial import SpatialState


class FreeBody:
    """One body that moves in space; see `RobotModel`."""

    in_space = True
    _body: int

    def place(self, model: mujoco.MjModel, data: mujoco.MjData, start: SpatialState) -> None:
        """Put the body where it starts."""
        x, y, z, w = start.quat
        data.qpos[:7] = *start.position, w, x, y, z
        data.qvel[:6] = *start.velocity, *start.rate

    def set_inertia(self, model: mujoco.MjModel, inertia: np.ndarray) -> None:
        """Give the body an inertia tensor about its centre of mass, shape (3, 3) [kg·m²]."""
        moments, axes = np.linalg.eigh(inertia)
        axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])  # a rotation, not a mirror image
        mujoco.mju_mat2Quat(model.body_iquat[self._body], axes.ravel())
        model.body_inertia[self._body] = moments


def tensor_of(world: Any) -> np.ndarray:
    """Inertia tensor of the body of a `SpatialWorld` without a batch axis, shape (3, 3) [kg·m²]."""
    return matrix_of(world.inertia)
