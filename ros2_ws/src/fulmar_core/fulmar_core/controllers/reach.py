"""How hard a bank of valves can push a body in a direction against what pushes from outside."""

from __future__ import annotations

import itertools

import numpy as np

from fulmar_core.actuators.thrusters import Thrusters

UNBOUNDED = 1e6  # where no side stands in the way, as for a direction of length 0 [N]


class Reach:
    """The forces that valves can bring up in the plane, as a convex polygon."""

    def __init__(self, thrusters: Thrusters) -> None:
        """Find the polygon's sides: lines through two corners that leave all others on one side.

        With a shared pressure line the corners are what single valves do, else what combinations do.
        """
        count = len(thrusters.nozzles)
        alone = np.eye(count)
        combinations = (
            alone
            if thrusters.shared_pressure
            else np.array(list(itertools.product((0.0, 1.0), repeat=count)))
        )
        force = thrusters.wrench_in_body(combinations)[0][:, :2]
        corners = np.unique(np.round(np.vstack((force, np.zeros(2))), 9), axis=0)
        sides = []
        for a, b in itertools.permutations(range(len(corners)), 2):
            x, y = corners[b] - corners[a]
            normal = np.array([y, -x]) / np.hypot(x, y)
            level = float(normal @ corners[a])
            if np.all(corners @ normal <= level + 1e-6):
                sides.append((*normal, level))
        table = np.unique(np.round(np.array(sides), 6), axis=0)
        self._normals, self._levels = table[:, :2], table[:, 2]

    def holds(self, push: np.ndarray) -> np.ndarray:
        """Whether the valves can bring up the opposite of a push in the body's frame, shape (..., 2) to (...,) [N]."""
        return np.asarray(np.all(self._levels + push @ self._normals.T >= 0.0, axis=-1))

    def along(self, direction: np.ndarray, push: np.ndarray) -> np.ndarray:
        """Largest total force straight along a direction.

        Args:
            direction: Unit vectors in the body's frame, shape (..., 2).
            push: Force from outside, same frame and shape [N].

        Returns:
            Thrust and push together, shape (...,), at least 0 [N].
        """
        room = self._levels + push @ self._normals.T
        steep = direction @ self._normals.T
        most = np.where(steep > 1e-6, room / np.maximum(steep, 1e-6), UNBOUNDED)
        return np.asarray(np.maximum(np.min(most, axis=-1), 0.0))
