"""What the air does to an aircraft: geometry, coefficients and ground effect, as read from a robot's `airframe`.

Inside, axes are those of flight mechanics: x ahead, y to the right, z down. The rest of Fulmar has y to the left and z
up (REP-103); `FlightDynamics` converts.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from fulmar_core.robots.airframe.coefficients import ALPHADOT, Coefficients
from fulmar_core.robots.airframe.ground_effect import GroundEffect, near_ground
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.attitude import Vector
from fulmar_core.states.rotation import Array

SLOWEST = 0.5  # airspeed that coefficients of rates are computed for at the least [m/s]
LOST = 1.5  # times the stall angle, from which on a craft counts as lost (thesis §5.4.1) [-]


@dataclass(frozen=True)
class Airframe:
    """A wing with its body and tail."""

    span: float  # b [m]
    area: float  # S [m²]
    chord: float  # mean aerodynamic [m]
    taper: float  # chord at the tip over that at the root [-]
    speed: float  # of cruise: what tasks and gains are for [m/s]
    stall_deg: float  # angle of attack beyond which the coefficients say nothing [deg]
    aerodynamics: Coefficients
    ground_effect: GroundEffect | None = None  # None: free air at every height
    # Axes that CD, CY and CL are along. standard: those of the wind. stability: turned by the angle of attack alone, as
    # derivatives of textbooks are, so that CY is along the body's y and no drag of a sideslip is. mirrored: turned into
    # the body with the sign of the sideslip reversed, as PyFly and FALCON-S have it by mistake; for an aircraft whose
    # flights are to be theirs.
    wind_axes: Literal["standard", "stability", "mirrored"] = "standard"
    estimated: bool = False  # True: the source has gaps, and numbers here are no figures to compare with
    jsbsim: tuple[str, ...] = ()  # models that come with JSBSim and may stand for the craft, as jsbsim:NAME

    def __post_init__(self) -> None:
        for name in ("span", "area", "chord", "speed", "stall_deg"):
            if getattr(self, name) <= 0.0:
                raise ValueError(f"'{name}' = {getattr(self, name):g} must be greater than 0.")
        if not 0.0 < self.taper <= 1.0:
            raise ValueError(f"'taper' = {self.taper:g} must lie in (0, 1].")
        if self.chord > 2.0 * self.area / self.span:
            raise ValueError(
                f"'chord' = {self.chord:g} m may be {2.0 * self.area / self.span:.3g} m at most, twice 'area' / 'span' "
                f"= {self.area:g} m² / {self.span:g} m: no wing has such a mean chord. Take the three from one source."
            )

    @property
    def aspect_ratio(self) -> float:
        """Squared span over area [-]."""
        return self.span**2 / self.area

    @property
    def lost_deg(self) -> float:
        """Angle of attack from which on the craft counts as lost [deg]."""
        return LOST * self.stall_deg

    @functools.cached_property
    def slow_terms(self) -> dict[str, float]:
        """Numbers of the terms of `alphadot`, by coefficient."""
        found = {}
        for name, terms in self.aerodynamics.parsed.items():
            for number, factors in terms:
                if factors == ((ALPHADOT, 1),):
                    found[name] = number
        return found

    def coefficients(self, air: Flow, height: Array) -> dict[str, Array]:
        """The six coefficients, near the ground too, shapes (...,).

        Args:
            air: The flow.
            height: Of the centre of mass above the ground [m].
        """
        found = self.aerodynamics.at(air.factors)
        if self.ground_effect is not None:
            found["CL"], found["CD"] = near_ground(
                found["CL"],
                found["CD"],
                height,
                effect=self.ground_effect,
                aspect_ratio=self.aspect_ratio,
                taper=self.taper,
                span=self.span,
            )
        return found

    def loads(self, coefficients: Mapping[str, Array], air: Flow, density: Array) -> tuple[Vector, Vector]:
        """Force [N] and moment about the centre of mass [N·m], x ahead, y to the right, z down.

        Lift and drag are along the wind's axes: rotation by the angle of attack and the sideslip (Stevens, Lewis and
        Johnson, Aircraft Control and Simulation, 2016, §2.3), or along others, see `wind_axes`.
        """
        c, push = coefficients, 0.5 * density * air.speed * air.speed * self.area
        ca, sa, cb, sb = air.turned
        if self.wind_axes == "mirrored":
            sb = -sb
        if self.wind_axes == "stability":
            cb, sb = 1.0 + 0.0 * cb, 0.0 * sb
        along = -c["CD"] * cb - c["CY"] * sb
        force = (
            push * (along * ca + c["CL"] * sa),
            push * (c["CY"] * cb - c["CD"] * sb),
            push * (along * sa - c["CL"] * ca),
        )
        return force, (push * self.span * c["Cl"], push * self.chord * c["Cm"], push * self.span * c["Cn"])


@dataclass(frozen=True, slots=True)
class Flow:
    """The air as it meets an aircraft, shapes (...,)."""

    speed: Array  # [m/s]
    turned: tuple[Array, Array, Array, Array]  # cosine and sine of α and of β
    factors: dict[str, Array]  # as in `Coefficients.at`


def flow_past(velocity: Vector, rate: Vector, surfaces: Mapping[str, Array], airframe: Airframe) -> Flow:
    """The flow that an aircraft meets.

    Args:
        velocity: Of the aircraft through the air, x ahead, y right, z down [m/s].
        rate: Of its turn against the air, same axes [rad/s].
        surfaces: Deflections by name, in Fulmar's signs [rad].
        airframe: Its span and chord.
    """
    u, v, w = velocity
    xp = array_namespace(u)
    flat = xp.sqrt(u * u + w * w) + 1e-9
    speed = xp.sqrt(flat * flat + v * v)
    turned = u / flat, w / flat, flat / speed, v / speed
    half = 0.5 / clip(speed, SLOWEST, None)
    factors = {
        "alpha": xp.atan2(w, u),
        "beta": xp.atan2(v, flat),
        "p": half * airframe.span * rate[0],
        "q": half * airframe.chord * rate[1],
        "r": half * airframe.span * rate[2],
        **surfaces,
    }
    return Flow(speed, turned, factors)


def alpha_rate(velocity: Vector, acceleration: Vector) -> Array:
    """How fast the angle of attack changes, shape (...,) [rad/s].

    Args:
        velocity: As in `flow_past`.
        acceleration: Its change in the body's own axes [m/s²].
    """
    u, _, w = velocity
    return (u * acceleration[2] - w * acceleration[0]) / (u * u + w * w + math.ulp(1.0))
