"""What `fulmar check robot` finds out about a robot of each kind."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable

from fulmar_evaluation.aircraft_check import AircraftCheck, check_aircraft
from fulmar_evaluation.wrench_check import FreeFlyerCheck, SatelliteCheck, SpaceCheck, WheelCheck, WrenchCheck

Findings = WrenchCheck | AircraftCheck

# From a robot, and the speed, altitude and height that a trim was asked for at; each None if none was.
CHECKS: dict[str, Callable[..., Findings]] = defaultdict(
    lambda: SpaceCheck.of,
    planar=WrenchCheck.of,
    rolling=WheelCheck.of,
    free_flyer=FreeFlyerCheck.of,
    satellite=SatelliteCheck.of,
    aircraft=check_aircraft,
)
