"""Reference paths in the plane, each given by a few sizes.

The explicit table of paths. A new path is one class and one line below.
"""

from __future__ import annotations

from typing import get_args, get_type_hints

from fulmar_core.tasks.references.curves import (
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
from fulmar_core.tasks.references.race_track import RaceTrack
from fulmar_core.tasks.references.rounded import Capsule, Line, Rectangle

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
    | Line
    | Rectangle
    | Capsule
    | RaceTrack
)

PATHS = {get_args(get_type_hints(path)["kind"])[0]: path for path in get_args(ReferencePath)}
