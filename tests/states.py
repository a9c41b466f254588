"""States that tests begin from."""

from __future__ import annotations

import numpy as np

from fulmar_core.planar import PlanarState, rigid_of
from fulmar_core.state import RigidBodyState


def planar_state(
    x: float, y: float, yaw: float, *, vx: float = 0.0, vy: float = 0.0, yaw_rate: float = 0.0
) -> RigidBodyState:
    """State of one body in the plane z = 0; units as in `PlanarState`."""
    return rigid_of(PlanarState(*(np.asarray(value, dtype=float) for value in (x, y, yaw, vx, vy, yaw_rate))))
