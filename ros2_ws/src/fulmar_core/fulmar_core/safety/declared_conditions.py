"""The conditions of a robot as its file declares it, or as it was identified, beside the body that was certified."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fulmar_core.robots.robot import Robot

Body = Mapping[str, Any]  # as `certified_body` makes it


def certified_body(robot: Robot) -> dict[str, Any]:
    """What the factors of a certified set refer to, ready for JSON.

    Returns:
        `mass` [kg], `inertia` about x, y and z [kg·m²], `center_of_mass` [m], `force` and `torque` of the actuators [N,
        N·m], their `delay` [s]; of boats `drag`, the damping ahead and aside at cruise and of a turn [N, N, N·m].
    """
    body, its = robot.body, robot.performance
    found: dict[str, Any] = {
        "mass": body.mass,
        "inertia": list(body.inertia[:3]),
        "center_of_mass": list(body.center_of_mass),
        "force": its.force,
        "torque": its.torque,
        "delay": robot.actuators.response.delay_s,
    }
    water = robot.hydrodynamics
    if water is not None:
        found["drag"] = [
            abs(float(part)) for part in water.planar_damping(its.speed, its.speed, its.yaw_rate)
        ]
    return found


def declared_conditions(robot: Robot, of: Body) -> dict[str, float]:
    """How far a robot may be from the body that was certified.

    Args:
        robot: As identified where a calibration is in use, else as its file declares it: `uncertainty` says how far the
            real one may be from the file.
        of: The body that was certified.

    Returns:
        Values by axis: factors of mass, inertia and drag [x], offset of the centre of mass [m], lost share of the
        thrust, and delay [s].
    """
    mine, spans = certified_body(robot), robot.uncertainty
    yaw = mine["inertia"][2]
    inertia = max(
        _factor(was, (now * spans.yaw_inertia[0] / yaw, now * spans.yaw_inertia[1] / yaw))
        for was, now in zip(of["inertia"], mine["inertia"], strict=True)
    )
    away = (
        sum((b - a) ** 2 for a, b in zip(of["center_of_mass"], mine["center_of_mass"], strict=False)) ** 0.5
    )
    found = {
        "mass": _factor(of["mass"], spans.mass),
        "inertia": inertia,
        "center_of_mass": spans.center_of_mass + away,
        "thrust_loss": max(_lost(of["force"], mine["force"]), _lost(of["torque"], mine["torque"])),
        "delay": max(mine["delay"] - of["delay"], 0.0),
    }
    if "drag" in mine and "drag" in of:
        found["drag"] = _drag(of["drag"], mine["drag"], spans.drag)
    return found


def _factor(nominal: float, span: tuple[float, float]) -> float:
    """By how much a quantity is multiplied or divided at most, >= 1."""
    return max(span[1] / nominal, nominal / span[0], 1.0)


def _lost(was: float, now: float) -> float:
    """Share of a force that is lost, >= 0."""
    return max(1.0 - now / was, 0.0) if was > 0.0 else 0.0


def _drag(was: Sequence[float], now: Sequence[float], span: tuple[float, float]) -> float:
    """The largest factor of any axis that water damps."""
    pairs = [(a, b) for a, b in zip(was, now, strict=True) if a > 0.0 and b > 0.0]
    return max((_factor(a, (b * span[0], b * span[1])) for a, b in pairs), default=1.0)
