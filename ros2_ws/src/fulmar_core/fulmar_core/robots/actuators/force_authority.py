"""How hard one-way actuators can push a body in a direction against what pushes from outside."""

from __future__ import annotations

import itertools

import numpy as np

from fulmar_core.robots.actuators.pushing import Pushing

UNBOUNDED = 1e6  # where no side stands in the way, as for a direction of length 0 [N]


class ForceAuthority:
    """The forces that valves or fans can bring up in the plane, as a convex polygon."""

    def __init__(self, thrusters: Pushing) -> None:
        """Find the polygon's sides.

        With a shared pressure line it is the hull of what single valves do; without, the sum of what each does or
        leaves undone (a zonotope), whose sides lie along the nozzles.
        """
        alone = thrusters.wrench_in_body(np.eye(len(thrusters.names)))[0][:, :2]
        sides = _hull(alone) if thrusters.shared_pressure else _zonotope(alone)
        table = np.unique(np.round(np.array(sides), 6), axis=0)
        self._normals, self._levels = table[:, :2], table[:, 2]
        #: Force that the valves bring up in any direction, a little less for what rounding takes [N].
        self.at_least = (1.0 - 1e-6) * float((self._levels / np.hypot(*self._normals.T)).min())

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


def _hull(forces: np.ndarray) -> list[tuple[float, float, float]]:
    """Lines through two corners that leave all others on one side: normals and levels."""
    corners = np.unique(np.round(np.vstack((forces, np.zeros(2))), 9), axis=0)
    sides = []
    for a, b in itertools.permutations(range(len(corners)), 2):
        x, y = corners[b] - corners[a]
        normal = np.array([y, -x]) / np.hypot(x, y)
        level = float(normal @ corners[a])
        if np.all(corners @ normal <= level + 1e-6):
            sides.append((*normal, level))
    return sides


def _zonotope(forces: np.ndarray) -> list[tuple[float, float, float]]:
    """Lines along each force, and across it for banks whose forces are all parallel: normals and levels."""
    along = forces / np.hypot(*forces.T)[:, None]
    across = np.stack((along[:, 1], -along[:, 0]), axis=-1)
    normals = np.concatenate((along, -along, across, -across))
    levels = np.maximum(forces @ normals.T, 0.0).sum(axis=0)
    return [(x, y, level) for (x, y), level in zip(normals.tolist(), levels.tolist(), strict=True)]
