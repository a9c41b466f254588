"""Episodes drawn ahead of need, for many worlds at once: a few at a time would cost more than the physics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic

import numpy as np

from fulmar_core.robots.sensors.odometer import FirstReading
from fulmar_core.states.counter_rng import Keys, write_keys
from fulmar_core.states.rotation import Array
from fulmar_core.states.state import S
from fulmar_core.tasks.goal import Goal
from fulmar_core.worlds.world import World


@dataclass(frozen=True, slots=True)
class Beginning(Generic[S]):
    """Everything that is settled before the first step of an episode of each world."""

    start: S
    goal: Goal
    world: World
    command: Array  # that actuators begin with, shape (worlds, n)
    noise_keys: Keys  # of what actuators do wrong
    reading: FirstReading

    def write(self, index: Array, other: Beginning) -> None:
        """Overwrite some worlds in place."""
        self.start.write(index, other.start)
        self.goal.write(index, other.goal)
        self.world.write(index, other.world)
        self.command[index] = other.command
        write_keys(self.noise_keys, index, other.noise_keys)
        self.reading.write(index, other.reading)


Draw = Callable[[np.ndarray, np.ndarray], Beginning]  # of some worlds that began anew so often


class UpcomingEpisodes:
    """The next episode of every world. What it is does not depend on when it is drawn."""

    def __init__(self, draw: Draw, worlds: int) -> None:
        self._draw = draw
        self._ready = np.zeros(worlds, dtype=bool)
        self._next: Beginning | None = None

    def forget(self) -> None:
        """Draw all anew when they are needed: what they are drawn from has changed."""
        self._ready[:] = False

    def begin(self, which: np.ndarray, repeats: np.ndarray) -> Beginning:
        """Use up the next episodes of some worlds.

        Args:
            which: Numbers of the worlds in the batch.
            repeats: How often every world has begun anew when these have, shape (worlds,).

        Returns:
            Of every world in the batch; until the next call, what it says of these is how they begin.
        """
        if not self._ready[which].all():
            self._refill(which, repeats)
        self._ready[which] = False
        assert self._next is not None
        return self._next

    def _refill(self, which: np.ndarray, repeats: np.ndarray) -> None:
        """Draw for every world whose next episode is not there yet."""
        coming = repeats + 1
        coming[which] = repeats[which]
        missing = np.flatnonzero(~self._ready)
        drawn = self._draw(missing, coming[missing])
        if self._next is None:
            assert len(missing) == len(self._ready)
            self._next = drawn
        else:
            index = missing if isinstance(drawn.start.like, np.ndarray) else missing.tolist()
            self._next.write(index, drawn)
        self._ready[:] = True
