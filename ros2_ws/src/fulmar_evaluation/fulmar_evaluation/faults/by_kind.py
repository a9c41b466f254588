"""What faults differ in between kinds of vehicles."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from fulmar_core.states.state import RigidBodyState

STAYS = "it stays where it is"  # why what only turns has no limits of place
UNSEEN = "it is not seen by motion capture"
CONTRADICTS = "its controller steers against a drift, and faster odometry contradicts itself (gnss_creeps)"
_STARLESS = dict.fromkeys(("star_tracker_frozen", "star_tracker_drifts"), "no star tracker is in its loop")
TOO_MUCH = 2.0  # times the limit
OF_EACH = 0.8  # of the limit, about each of three axes: together 1.39 of it


@dataclass(frozen=True)
class Distance:
    """How far from its goal a robot is.

    Attributes:
        of: From the true state, the goal, and the number of coordinates of a place.
        near: Within which the robot is at its goal.
        astray: By which it may be farther away after a while.
    """

    of: Callable[[RigidBodyState, Sequence[float], int], float]
    near: float
    astray: float


def _apart(state: RigidBodyState, goal: Sequence[float], axes: int) -> float:
    """Between two places [m]."""
    return math.dist(state.position_in_world[:axes].tolist(), goal[:axes])


def _turned(state: RigidBodyState, goal: Sequence[float], _axes: int) -> float:
    """Between two attitudes [deg]."""
    dot = abs(sum(a * float(b) for a, b in zip(goal[3:7], state.quat_xyzw, strict=True)))
    return math.degrees(2.0 * math.acos(min(1.0, dot)))


@dataclass(frozen=True)
class Faults:
    """Of one kind.

    Attributes:
        excused: Why it cannot have a fault, by the name of the fault.
        too_fast: Turn rate by axis that it cannot have, though that about each alone may be; in its limit [-].
        distance: From its goal.
        creep: Of a position from satellites, with a velocity that knows nothing of it [m/s].
    """

    excused: Mapping[str, str] = field(default_factory=lambda: _STARLESS)
    too_fast: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys("xyz", OF_EACH))
    distance: Distance = Distance(_apart, near=0.3, astray=0.5)
    creep: float = 0.3


_OF_PLACE = ("odometry_leaves_the_area", "odometry_leaves_the_geofence")
_IN_PLANE = Faults(too_fast={"z": TOO_MUCH})
FAULTS = defaultdict(
    Faults,
    planar=_IN_PLANE,
    rolling=_IN_PLANE,
    satellite=Faults(
        {
            "mocap_frozen": UNSEEN,
            "time_jump_backwards": "its wheels stamp what they measure by the same clock, and are not relayed",
            **dict.fromkeys(_OF_PLACE, STAYS),
        },
        distance=Distance(_turned, near=5.0, astray=5.0),
    ),
    # At its speed a creep as slow as that of others is within the error of its velocity.
    aircraft=Faults(_STARLESS | dict.fromkeys(_OF_PLACE, CONTRADICTS), creep=3.0),
)
