"""Episodes drawn ahead of need, for many worlds at once: a few at a time would cost more than the physics."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fulmar_core.disturbances.world import World
from fulmar_core.episode import Episode
from fulmar_core.goal import Goal
from fulmar_core.planar import PlanarState
from fulmar_core.rotation import Array

Draw = Callable[[np.ndarray, np.ndarray], Episode]  # of some worlds that began anew so often


class UpcomingEpisodes:
    """The next episode of every world. What it is does not depend on when it is drawn."""

    def __init__(self, draw: Draw, worlds: int) -> None:
        """Draw nothing yet."""
        self._draw = draw
        self._ready = np.zeros(worlds, dtype=bool)
        self._episodes: Episode | None = None

    def forget(self) -> None:
        """Draw all anew when they are needed: what they are drawn from has changed."""
        self._ready[:] = False

    def begin(
        self,
        which: np.ndarray,
        index: Array,
        repeats: np.ndarray,
        start: PlanarState,
        goal: Goal,
        world: World,
    ) -> None:
        """Write the next episodes of some worlds over what they have now.

        Args:
            which: Numbers of the worlds in the batch.
            index: The same, as an index of the arrays' library.
            repeats: How often every world has begun anew when these have, shape (worlds,).
            start: State to overwrite.
            goal: Goal to overwrite.
            world: Worlds to overwrite.
        """
        if not self._ready[which].all():
            self._refill(which, repeats)
        assert self._episodes is not None
        start.write(index, self._episodes.start[index])
        goal.write(index, self._episodes.goal[index])
        world.write(index, self._episodes.world[index])
        self._ready[which] = False

    def _refill(self, which: np.ndarray, repeats: np.ndarray) -> None:
        """Draw for every world whose next episode is not there yet."""
        coming = repeats + 1
        coming[which] = repeats[which]
        missing = np.flatnonzero(~self._ready)
        drawn = self._draw(missing, coming[missing])
        if self._episodes is None:
            assert len(missing) == len(self._ready)
            self._episodes = drawn
        else:
            index = missing if isinstance(drawn.start.x, np.ndarray) else missing.tolist()
            self._episodes.start.write(index, drawn.start)
            self._episodes.goal.write(index, drawn.goal)
            self._episodes.world.write(index, drawn.world)
        self._ready[:] = True
