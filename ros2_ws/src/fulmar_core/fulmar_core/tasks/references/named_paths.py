"""Paths in space by name, given by one size: how far they keep from the place that they lead about."""

from __future__ import annotations

from collections.abc import Callable

from fulmar_core.config.errors import UnknownNameError
from fulmar_core.tasks.references import ReferencePath
from fulmar_core.tasks.references.curves import BernoulliLemniscate, Circle, Lissajous, Spiral
from fulmar_core.tasks.references.in_space import Lifted, Place, SpacePath, TwoCircles
from fulmar_core.tasks.references.rounded import Capsule, Line, Rectangle

TILTED = (30.0, 20.0, 0.0)  # roll, pitch, yaw of the plane of paths about the place [deg]


def _about(curve: ReferencePath) -> SpacePath:
    """A curve about the place, in a plane that is tilted, so that the path looks down on what lies flat."""
    return Lifted("lifted", curve, TILTED)


def _beside(curve: ReferencePath, way: Place) -> SpacePath:
    """A curve that leads through its own middle, in a plane beside the place."""
    return Lifted("lifted", curve, centre=way)


# By name: what makes the path that comes so near [m]. All but the last are those of thesis Fig. 6.3, and a line.
NAMED: dict[str, Callable[[float], SpacePath]] = {
    "circle": lambda r: _about(Circle("circle", r)),
    "spiral": lambda r: _about(Spiral("spiral", r, 1.3 * r, 2.0)),
    "capsule": lambda r: _about(Capsule("capsule", r, r)),
    "rectangle": lambda r: _about(Rectangle("rectangle", 2.6 * r, 2.0 * r, 0.6 * r)),
    "lemniscate": lambda r: _beside(BernoulliLemniscate("bernoulli_lemniscate", 1.5 * r), (0.0, 0.0, r)),
    "lissajous": lambda r: _beside(Lissajous("lissajous", r, r, 3, 2), (0.0, 0.0, r)),
    "line": lambda r: _beside(Line("line", 3.0 * r), (0.0, r, 0.0)),
    "two_circles": lambda r: TwoCircles("two_circles", r),
}


def named_path(name: str, nearest: float) -> SpacePath:
    """The path of a name of `NAMED` that comes so near to the origin [m].

    Raises:
        UnknownNameError: There is none of this name.
    """
    if name not in NAMED:
        raise UnknownNameError("path", name, NAMED)
    return NAMED[name](nearest)
