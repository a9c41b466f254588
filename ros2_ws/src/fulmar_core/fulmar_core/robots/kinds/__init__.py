"""The kinds of vehicles, by name: another one is its own file and a row here.

What a higher room or package adds for each stands in that room's table, `by_kind.py`; callers look up, and ask no
robot what it is.
"""

from __future__ import annotations

from fulmar_core.robots.actuators.family import Actuators
from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.robots.kinds.aircraft import AIRCRAFT
from fulmar_core.robots.kinds.free_flyer import FREE_FLYER
from fulmar_core.robots.kinds.kind import Kind
from fulmar_core.robots.kinds.planar import PLANAR
from fulmar_core.robots.kinds.rolling import ROLLING
from fulmar_core.robots.kinds.satellite import SATELLITE
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import State

KINDS: dict[str, Kind] = {kind.name: kind for kind in (PLANAR, ROLLING, FREE_FLYER, SATELLITE, AIRCRAFT)}
# Kinds that go to places and stop there, by the form of their states: what most tasks are for.
GOING: dict[type[State], tuple[Kind, ...]] = {PlanarState: (PLANAR, ROLLING), SpatialState: (FREE_FLYER,)}


def kind_of(actuators: Actuators, *, planar: bool, swims: bool) -> Kind:
    """The kind of a robot.

    Args:
        actuators: What moves it.
        planar: Whether its body only moves in the plane.
        swims: Whether water carries it.
    """
    if actuators.flies:
        return AIRCRAFT
    if actuators.turns_only:
        return SATELLITE
    if isinstance(actuators, Rolling):
        return ROLLING
    return PLANAR if planar or swims else FREE_FLYER
