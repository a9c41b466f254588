"""How far bodies of one robot may differ: mass, inertia, and where and how strongly its thrusters push."""

from __future__ import annotations

from dataclasses import dataclass

from fulmar_core.robots.actuators.family import Actuators

Range = tuple[float, float]


@dataclass(frozen=True)
class Morphology:
    """Spans that scenarios with `body: morphology` draw a body from, for each episode anew."""

    mass: Range  # [kg]
    size: Range  # factor on the sides of the body, which counts squared in its inertia [-]
    inertia: Range  # factor on each moment of inertia, beside those of mass and size [-]
    places: Range  # factor on where thrusters push [-]
    directions_deg: float  # largest angle by which each thruster's direction is off [deg]
    thrust: Range  # factor on the thrust of all [-]

    def __post_init__(self) -> None:
        for name in ("mass", "size", "inertia", "places", "thrust"):
            low, high = getattr(self, name)
            if not 0.0 < low <= high:
                raise ValueError(f"'{name}' must be [low, high] with 0 < low <= high, found [{low}, {high}].")
        if not 0.0 <= self.directions_deg <= 45.0:
            raise ValueError(f"'directions_deg' = {self.directions_deg:g} must lie in [0, 45].")

    @staticmethod
    def check_part_of(actuators: Actuators) -> None:
        """Refuse what it is not for.

        Raises:
            ValueError: Anything but thrusters that open by degrees and share nothing.
        """
        wrenches = actuators.full_wrenches
        if actuators.kind != "thrusters" or actuators.binary or wrenches is None or wrenches[2]:
            raise ValueError(
                "'morphology' is for thrusters with 'continuous: true' and 'shared_pressure: false'. Leave it out."
            )
