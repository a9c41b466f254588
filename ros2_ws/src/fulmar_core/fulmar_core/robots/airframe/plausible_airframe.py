"""Plausible numbers of aircraft: geometry, motors, and the signs and sizes of aerodynamic derivatives.

Signs are those of B. Etkin and L. D. Reid, Dynamics of Flight, 3rd ed., 1996, ch. 2, 3 and 5; sizes enclose the
aircraft of R. C. Nelson, Flight Stability and Automatic Control, 1998, App. B (Navion to Boeing 747), of J. Roskam,
Airplane Flight Dynamics, Part I, App. B, and the airframes that Fulmar ships.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from fulmar_core.config.plausible_ranges import BODY, Plausible, Range, edge_inertia
from fulmar_core.robots.airframe.atmosphere import SEA_LEVEL
from fulmar_core.robots.airframe.coefficients import ALPHADOT, ANGLES, RATES, SURFACES, Coefficients
from fulmar_core.states.gravity import GRAVITY

STEP = 1e-5  # of factors in central differences [rad, -]
DAMPS = "air slows a turn down"
# Coefficient, factor, possible and usual derivative [1/rad or -], and why.
DERIVATIVES: tuple[tuple[str, str, Range, Range, str], ...] = (
    ("CL", "alpha", (1.0, 9.0), (2.0, 7.0), "2π of a thin profile, less of a wing; angles are in 'unit'"),
    ("CL", "q", (-0.5, 60.0), (0.0, 20.0), "tails lift as the nose rises"),
    ("CL", "elevator", (-0.02, 4.0), (0.0, 2.0), "a positive elevator has its trailing edge down: see 'signs'"),
    ("CL", ALPHADOT, (-5.0, 20.0), (0.0, 8.0), "tails meet the wing's downwash late"),
    ("CD", "alpha", (-0.2, 4.0), (0.0, 1.2), "2 CL CLα / (π e · aspect ratio), of induced drag"),
    ("CY", "beta", (-4.0, 0.0), (-1.5, -0.02), "wind from the right pushes to the left"),
    ("CY", "rudder", (0.0, 2.0), (0.02, 0.6), "a positive rudder has its trailing edge left: see 'signs'"),
    ("Cl", "beta", (-1.5, 0.02), (-0.5, 0.0), "dihedral and sweep: wind from the right lifts the right wing"),
    ("Cl", "p", (-3.0, -0.02), (-1.2, -0.15), DAMPS),
    ("Cl", "r", (-0.02, 2.0), (0.0, 0.6), "the wing that turns outside is faster, and lifts"),
    ("Cl", "aileron", (0.003, 3.0), (0.01, 0.7), "a positive aileron lowers the right wing: see 'signs'"),
    ("Cl", "rudder", (-0.2, 0.4), (-0.03, 0.15), "the force on the rudder, above the centre of mass"),
    ("Cm", "alpha", (-12.0, -0.005), (-4.0, -0.1), "stable in pitch: the centre of mass is ahead of the neutral point"),
    ("Cm", "q", (-150.0, -0.2), (-50.0, -1.0), DAMPS),
    ("Cm", ALPHADOT, (-60.0, 0.0), (-25.0, 0.0), "tails meet the wing's downwash late"),
    ("Cm", "elevator", (-15.0, -0.01), (-6.0, -0.1), "a positive elevator lowers the nose: see 'signs'"),
    ("Cn", "beta", (0.001, 2.0), (0.01, 0.6), "stable in yaw: the nose turns into the wind"),
    ("Cn", "p", (-1.0, 0.5), (-0.4, 0.1), "drag of the wing that goes down"),
    ("Cn", "r", (-3.0, 0.0), (-1.0, -0.01), DAMPS),
    ("Cn", "aileron", (-0.5, 0.5), (-0.2, 0.1), "drag of a lowered aileron"),
    ("Cn", "rudder", (-2.0, -0.002), (-0.4, -0.01), "a positive rudder turns the nose to the left: see 'signs'"),
)  # fmt: skip
LEVEL: tuple[tuple[str, Range, Range, str], ...] = (  # with every factor at 0
    ("CL", (-0.3, 3.0), (-0.15, 1.3), "level flight"),
    ("CD", (0.002, 1.0), (0.006, 0.2), "friction of a clean craft to one with its flaps out"),
    ("Cm", (-1.0, 1.0), (-0.3, 0.3), "what an elevator holds"),
)
# What dimensionless rates are per.
PER = {"p": "per p b/2V", "q": "per q c/2V", "r": "per r b/2V", ALPHADOT: "per α̇ c/2V"}
# Of a coefficient from half the stall angle downwards to it upwards, in sideslip, and with each surface at its stops.
EXTREMES: tuple[tuple[str, Range, Range], ...] = (
    ("CL", (-3.0, 5.0), (-1.5, 3.0)), ("CD", (-0.02, 1.5), (0.0, 0.5)), ("CY", (-2.0, 2.0), (-0.8, 0.8)),
    ("Cl", (-1.0, 1.0), (-0.4, 0.4)), ("Cm", (-8.0, 8.0), (-4.0, 4.0)), ("Cn", (-0.8, 0.8), (-0.2, 0.2)),
)  # fmt: skip
SIDESLIP = 0.2  # in which they are looked at [rad]
# Without which nothing flies.
MUST = {("CL", "alpha"), ("Cl", "p"), ("Cm", "alpha"), ("Cm", "q"), ("Cn", "beta")}
OWN_AXIS = {"elevator": "Cm", "aileron": "Cl", "rudder": "Cn"}  # that a surface must move


def _at_one(robot: Any) -> float:
    """Airspeed at which a lift coefficient of 1 carries it at sea level [m/s]."""
    return math.sqrt(2.0 * robot.body.mass * GRAVITY / (SEA_LEVEL * robot.airframe.area))


def _pull(robot: Any) -> float:
    """Of all propellers together [N]."""
    return float(sum(motor.engine.thrust for motor in robot.actuators.motors))


AIRCRAFT: tuple[Plausible, ...] = (
    # Wings reach farther than other robots, and carry their mass near the middle.
    Plausible("body.radius", "m", (0.01, 30.0), (0.3, 10.0), "from hand-launched models to light aircraft"),
    Plausible(
        "body.inertia.2", "kg·m²", (0.01, 1.5), (0.03, 1.05), f"{BODY}: light aircraft 0.04 to 0.1 m r²",
        scale=lambda robot: edge_inertia(robot.body, upright=True),
    ),
    Plausible(
        "airframe.span", "m", (0.2, 1.1), (0.5, 1.01), "of twice the body's radius, which encloses the wing",
        scale=lambda robot: 2.0 * robot.body.radius,
    ),
    Plausible(
        "airframe.chord", "m", (0.02, 1.5), (0.04, 0.6), "of the span", scale=lambda robot: robot.airframe.span,
    ),
    Plausible(
        "airframe.area", "m²", (0.5, 2.0), (0.75, 1.25), "of span · chord",
        scale=lambda robot: robot.airframe.span * robot.airframe.chord,
    ),
    Plausible(
        "airframe.speed", "m/s", (0.6, 5.0), (0.85, 3.5), "of where a lift coefficient of 1 carries its weight",
        scale=_at_one,
    ),
    Plausible("airframe.stall_deg", "°", (4.0, 50.0), (8.0, 35.0), "wings to slender deltas"),
    Plausible(
        "airframe.ground_effect.wing_height", "m", (-0.6, 0.6), (-0.25, 0.25), "of the span, up positive",
        scale=lambda robot: robot.airframe.span,
    ),
    Plausible("actuators.surfaces.*.limit_deg", "°", (1.0, 60.0), (4.0, 45.0), "stops of surfaces"),
    Plausible("actuators.surfaces.*.rate_deg", "°/s", (8.0, 5000.0), (15.0, 1500.0), "electric to racing servos"),
    Plausible("actuators.servo_rate", "rad/s", (0.5, 400.0), (3.0, 250.0), "servos of 0.5 to 40 Hz"),
    Plausible("actuators.servo_damping", "of 1", (0.05, 10.0), (0.3, 3.0), "of critical damping"),
    Plausible(
        "actuators.motors.*.engine.thrust", "N", (0.01, 5.0), (0.05, 2.5), "of the weight: up to models that hover",
        scale=lambda robot: robot.body.mass * GRAVITY,
    ),
    Plausible(
        "actuators.motors.*.engine.power", "W", (3.0, 5000.0), (20.0, 800.0), "of the mass: 20 to 800 W/kg",
        scale=lambda robot: robot.body.mass,
    ),
    Plausible("actuators.motors.*.engine.efficiency", "of 1", (0.02, 2.0), (0.1, 1.0), "of propellers"),
    Plausible(
        "actuators.motors.*.engine.disc_area", "m²", (1e-4, 0.5), (0.001, 0.1), "of the squared span",
        scale=lambda robot: robot.airframe.span**2,
    ),
    Plausible(
        "actuators.motors.*.engine.jet_speed", "m/s", (1.0, 12.0), (1.1, 6.0), "of cruise, which a jet must exceed",
        scale=lambda robot: robot.airframe.speed,
    ),
    Plausible("actuators.motors.*.lag_s", "s", (0.0, 20.0), (0.0, 5.0), "electric motors to piston engines"),
    Plausible(
        "actuators.motors.*.position", "m", (0.0, 1.3), (0.0, 1.1), "motors sit on the body, within its radius",
        scale=lambda robot: robot.body.radius, distance=True,
    ),
    Plausible(
        "performance.force", "N", (0.2, 5.0), (0.5, 2.0), "of all propellers together", scale=_pull,
    ),
    Plausible(
        "performance.torque", "N·m", (1e-3, 40.0), (0.02, 20.0), "of the yaw inertia: rudders turn by up to 20 rad/s²",
        scale=lambda robot: robot.body.inertia[2],
    ),
    Plausible(
        "performance.speed", "m/s", (0.5, 2.0), (0.8, 1.3), "of airframe.speed",
        scale=lambda robot: robot.airframe.speed,
    ),
    Plausible(
        "performance.top_speed", "m/s", (0.95, 8.0), (1.05, 3.0), "of airframe.speed",
        scale=lambda robot: robot.airframe.speed,
    ),
    Plausible(
        "performance.yaw_rate", "rad/s", (0.01, 5.0), (0.05, 2.0), "of g / airframe.speed: a turn at 45° of bank",
        scale=lambda robot: GRAVITY / robot.airframe.speed,
    ),
)  # fmt: skip


def derivative_ranges(air: Coefficients, stops: Mapping[str, float], stall: float) -> Iterator[Plausible]:
    """Ranges of an aircraft's derivatives where its terms count from, in the unit and the signs of its file.

    Args:
        air: Its coefficients.
        stops: Largest deflection of each surface, which must move its own axis [rad].
        stall: Angle of attack up to which coefficients are of use [rad].
    """
    found = functools.cache(lambda: _derivatives(air))
    per_angle = math.radians(1.0) if air.unit == "deg" else 1.0
    for name, possible, usual, why in LEVEL:
        yield _row(name, "1", "[-]", possible, usual, why, of=functools.partial(_one, found, (name, "1")))
    for name, factor, possible, usual, why in DERIVATIVES:
        by = air.signs.get(factor, 1.0) * (per_angle if factor in ANGLES else 1.0)
        unit = PER.get(factor, "1/°" if air.unit == "deg" else "1/rad")
        yield _row(
            name, factor, unit, _times(possible, by), _times(usual, by), why,
            zero=(name, factor) in MUST or (factor in stops and OWN_AXIS.get(factor) == name),
            of=functools.partial(_one, found, (name, factor)),
        )  # fmt: skip
    whole = "rad" if air.unit == "rad" else "°"
    angles: tuple[tuple[str, Range, Range], ...] = (  # [deg]
        ("alpha_range.0", (-90.0, 8.0), (-30.0, 3.0)),
        ("alpha_range.1", (0.5, 90.0), (2.0, 50.0)),
        ("alpha_zero", (-20.0, 20.0), (-8.0, 8.0)),
        ("elevator_zero", (-30.0, 30.0), (-10.0, 10.0)),
    )
    turn = math.radians(1.0) if air.unit == "rad" else 1.0
    for key, possible, usual in angles:
        yield Plausible(
            f"airframe.aerodynamics.{key}", whole, _times(possible, turn), _times(usual, turn),
            "angles of attached flow, in 'unit'",
        )  # fmt: skip
    corners = functools.cache(lambda: _corners(air, stops, stall))
    for name, possible, usual in EXTREMES:
        yield Plausible(
            f"airframe.aerodynamics.terms.{name}", "[-]", possible, usual,
            f"all terms, from {-math.degrees(0.5 * stall):.3g} to {math.degrees(stall):.3g}°, at full surfaces too",
            of=functools.partial(_worst, corners, name, possible),
        )  # fmt: skip


def _row(
    name: str, factor: str, unit: str, possible: Range, usual: Range, why: str, *, of: Any, zero: bool = False
) -> Plausible:
    key = f"airframe.aerodynamics.terms.{name}.{factor}"
    return Plausible(key, unit, possible, usual, why, zero=zero, of=lambda _robot: of())


def _one(found: Any, key: tuple[str, str]) -> float:
    return float(found()[key])


def _worst(corners: Any, name: str, possible: Range, _robot: Any) -> float:
    """The smallest value where that is too small, else the largest."""
    low, high = float(corners()[name].min()), float(corners()[name].max())
    return low if low < possible[0] else high


def _corners(air: Coefficients, stops: Mapping[str, float], stall: float) -> dict[str, Any]:
    """Coefficients at angles of attack, sideslips and deflections of one surface at a time, shapes (n,)."""
    moved = [("", 0.0), *((name, side * most) for name, most in stops.items() for side in (-1.0, 1.0))]
    states = [
        {"alpha": alpha, "beta": beta, surface: deflection}
        for alpha in np.linspace(-0.5 * stall, stall, 7)
        for beta in (-SIDESLIP, 0.0, SIDESLIP)
        for surface, deflection in moved
    ]
    return air.at({name: np.array([state.get(name, 0.0) for state in states]) for name in ANGLES})


def _times(span: Range, by: float) -> Range:
    low, high = sorted(end * by for end in span)
    return low, high


def _derivatives(air: Coefficients) -> dict[tuple[str, str], float]:
    """Coefficients and derivatives where all factors of the file are 0, in its unit and signs."""
    per = math.radians(1.0) if air.unit == "deg" else 1.0
    low, high = air.alpha_range or (-math.inf, math.inf)
    origin = {
        "alpha": per * min(max(air.alpha_zero, low), high),
        "elevator": air.signs.get("elevator", 1.0) * per * air.elevator_zero,
    }
    moved = [factor for factor in (*ANGLES, *RATES) if factor != ALPHADOT]
    steps = np.zeros((1 + 2 * len(moved), len(moved)))
    for i in range(len(moved)):
        steps[1 + 2 * i, i], steps[2 + 2 * i, i] = STEP, -STEP
    flow = {factor: origin.get(factor, 0.0) + steps[:, i] for i, factor in enumerate(moved)}
    found: dict[tuple[str, str], float] = {}
    for name, values in air.at(flow).items():
        found[name, "1"] = float(values[0])
        found[name, ALPHADOT] = sum(
            number for number, factors in air.parsed[name] if factors == ((ALPHADOT, 1),)
        )
        for i, factor in enumerate(moved):
            slope = float(values[1 + 2 * i] - values[2 + 2 * i]) / (2.0 * STEP)
            sign = air.signs.get(factor, 1.0) if factor in SURFACES else 1.0
            found[name, factor] = slope * sign * (per if factor in ANGLES else 1.0)
    return found
