"""Reference paths in the plane, each told by a few sizes.

The explicit table of paths. A new path is one class and one line in each of the two places below.
"""

from __future__ import annotations

from fulmar_core.references.curves import (
    BernoulliLemniscate,
    Circle,
    GeronoLemniscate,
    Hippopede,
    Hypotrochoid,
    InfiniteSquare,
    Lissajous,
    Ngon,
    Sine,
    Spiral,
    Square,
)
from fulmar_core.references.race_track import RaceTrack

ReferencePath = (
    Circle
    | Square
    | InfiniteSquare
    | Spiral
    | BernoulliLemniscate
    | GeronoLemniscate
    | Lissajous
    | Hippopede
    | Hypotrochoid
    | Ngon
    | Sine
    | RaceTrack
)

PATHS: dict[str, type[ReferencePath]] = {
    "circle": Circle,
    "square": Square,
    "infinite_square": InfiniteSquare,
    "spiral": Spiral,
    "bernoulli_lemniscate": BernoulliLemniscate,
    "gerono_lemniscate": GeronoLemniscate,
    "lissajous": Lissajous,
    "hippopede": Hippopede,
    "hypotrochoid": Hypotrochoid,
    "ngon": Ngon,
    "sine": Sine,
    "race_track": RaceTrack,
}
