"""How well robots of a fleet held their places in a formation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fulmar_bags.run_record import RunRecord
from fulmar_core.loop.formation import ShapePlace

RMS, MOST = "shape_error_rms_m", "shape_error_most_m"  # of a robot's result


@dataclass(frozen=True)
class ShapeError:
    """Distance of a robot from its place in a formation, over a run."""

    rms_m: float
    most_m: float


def shape_errors(records: Mapping[str, RunRecord], places: Mapping[str, str]) -> dict[str, ShapeError]:
    """Distances of robots from their places, from the true poses that were recorded at the same times.

    Args:
        records: Of the robots, by name.
        places: Texts of `ShapePlace` by the robot's name; empty where it has none.

    Returns:
        By name, of those that have a place and were recorded with their leader.
    """
    found = {}
    for name, text in places.items():
        place = ShapePlace.of(text) if text else None
        if place is None or name not in records or place.leader not in records:
            continue
        own, leader = records[name].motion, records[place.leader].motion
        _, mine, theirs = np.intersect1d(
            np.round(own.stamp_s, 6), np.round(leader.stamp_s, 6), return_indices=True
        )
        if not len(mine):
            continue
        away = own.position[mine, :2] - leader.position[theirs, :2] - (place.x, place.y)
        square = np.sum(away**2, axis=-1)
        found[name] = ShapeError(math.sqrt(float(square.mean())), math.sqrt(float(square.max())))
    return found
