"""What follows from where targets on a path lie: coordinates, legs between them, and turns from leg to leg.

A task tells each target's direction and distance. Whether the next one lies within a turning circle, or on which side
of the leg after it, takes products of these, which small networks learn slowly. So a network may be shown them.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from fulmar_core.arrays import array_namespace
from fulmar_core.rotation import Array
from fulmar_core.tasks.passing import IN_ORDER, PLACE_TERMS

_SAFE = 1e-3  # added to lengths that are divided by [m]


def places_of(names: Sequence[str]) -> tuple[int, ...]:
    """Where each target's direction and distance begin among the names of terms; empty if it tells no path."""
    firsts = [f"{target}_{PLACE_TERMS[0]}" for target in IN_ORDER]
    return tuple(names.index(first) for first in firsts if first in names)


def coordinate_terms(targets: int) -> int:
    """How many terms `with_coordinates` adds for so many targets."""
    return 8 * targets - 6 if targets else 0


def with_coordinates(rows: Array, places: Sequence[int]) -> Array:
    """Rows of terms, followed by what they say of the path.

    Args:
        rows: As a task tells them, shape (worlds, n).
        places: Where each target's direction and distance begin, in their order, >= 1.

    Returns:
        Shape (worlds, n + `coordinate_terms`): each target's place in the body's frame [m]; then for each leg from one
        to the next its two components [m], its direction, and cosine and sine of the turn into it.
    """
    xp = array_namespace(rows)
    targets = [rows[:, i : i + 2] * rows[:, i + 2 : i + 3] for i in places]
    columns, before = [rows, *targets], _direction(targets[0])
    for here, there in itertools.pairwise(targets):
        leg = there - here
        along = _direction(leg)
        ahead = before[:, :1] * along[:, :1] + before[:, 1:] * along[:, 1:]
        aside = before[:, :1] * along[:, 1:] - before[:, 1:] * along[:, :1]
        columns += [leg, along, ahead, aside]
        before = along
    return xp.concat(columns, axis=1)


def _direction(leg: Array) -> Array:
    length = array_namespace(leg).sqrt(leg[:, :1] * leg[:, :1] + leg[:, 1:] * leg[:, 1:])
    return leg / (length + _SAFE)
