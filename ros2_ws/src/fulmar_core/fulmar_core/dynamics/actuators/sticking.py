"""Parts of a batch of robots that stick from a time on, and supplies that fall."""

from __future__ import annotations

import numpy as np
from array_api_compat import device

from fulmar_core.robots.actuators.parts import MovingParts
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.rotation import Array
from fulmar_core.worlds.world import World


class Sticking:
    """What commands become once a part of a robot stands where it is, whatever it is commanded."""

    def __init__(self, parts: MovingParts, like: Array) -> None:
        """Prepare; `like`: an array of the commands' floating type, shape (n, worlds)."""
        xp, kwargs = array_namespace(like), {"dtype": like.dtype, "device": device(like)}
        self._scale = xp.asarray(parts.scale, **kwargs)[:, None]
        self._rows = xp.asarray(np.arange(len(parts.names)), **kwargs)[:, None]
        matrix = parts.per_command
        self._to_parts = None if matrix is None else xp.asarray(matrix, **kwargs)
        self._to_command = None if matrix is None else xp.asarray(np.linalg.inv(matrix), **kwargs)

    def reached(self, target: Array, world: World, time_s: Array) -> Array:
        """What actuators move to.

        Args:
            target: What they would move to, shape (n, worlds).
            world: With `stuck_part`, `stuck_at` and `stuck_from`.
            time_s: In each episode, shape (worlds,) [s].

        Returns:
            Shape (n, worlds).
        """
        parts = target if self._to_parts is None else self._to_parts @ target
        sticks = (self._rows == world.stuck_part) & (time_s >= world.stuck_from)
        parts = array_namespace(target).where(sticks, world.stuck_at * self._scale, parts)
        return parts if self._to_command is None else self._to_command @ parts


def supplied(world: World, time_s: Array) -> Array:
    """Share of the full supply that is there at a time in each episode, shape (worlds,) [-]."""
    fallen = clip((time_s - world.supply_from) / world.supply_over, 0.0, 1.0)
    return 1.0 - fallen * (1.0 - world.supply_left)
