"""Check of an aircraft: trim over speed and height, modes with their names, and what its controls do."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from fulmar_core.config.errors import ConfigError
from fulmar_core.dynamics.flight_modes import Mode, continuous_model, modes_of
from fulmar_core.dynamics.flight_trim import Trim, find_trim
from fulmar_core.robots.robot import Robot

# Of the cruising speed, and, where there is ground effect, of the span: where trims are looked for [-].
SPEEDS, HEIGHTS = (0.8, 0.9, 1.0, 1.1, 1.2), (0.2, 0.5, 1.0)
# What each control is for, by the row of `continuous_model` that it acts on.
AXES = {"force_x": 6, "torque_x": 9, "torque_y": 10, "torque_z": 11}
UNITS = {"force_x": "m/s²", "torque_x": "rad/s²", "torque_y": "rad/s²", "torque_z": "rad/s²"}
FASTEST_S = (
    1.0  # in which a mode may double: what is faster no pilot, and no controller here, is meant for [s]
)
LEAST = 1e-3  # share of the strongest effect on an axis that counts as one [-]


@dataclass(frozen=True)
class Tried:
    """A speed and a height at which a trim was looked for."""

    speed: float  # [m/s]
    height: float | None  # None: free air [m]
    trim: Trim | None = None
    modes: tuple[Mode, ...] = ()
    missing: str = ""  # why there is none

    @property
    def where(self) -> str:
        """For people."""
        return f"{self.speed:.4g} m/s, {'free air' if self.height is None else f'{self.height:g} m'}"

    def as_json(self, altitude: float) -> dict[str, Any]:
        """As in `fulmar check robot --json`."""
        return {
            "speed": self.speed, "height": self.height, "altitude": altitude, "trims": self.trim is not None,
            "reason": self.missing or None,
        }  # fmt: skip


@dataclass(frozen=True)
class AircraftCheck:
    """Result for one aircraft.

    Attributes:
        tried: Where trims were looked for.
        altitude: Of them [m].
        authority: Acceleration at full deflection or throttle at the middle trim, by axis and control.
    """

    robot: Robot
    tried: tuple[Tried, ...]
    altitude: float
    authority: dict[str, dict[str, float]]

    @property
    def trims(self) -> tuple[tuple[Trim, tuple[Mode, ...]], ...]:
        """Those that were found, with their modes."""
        return tuple((each.trim, each.modes) for each in self.tried if each.trim is not None)

    @property
    def missing_axes(self) -> tuple[str, ...]:
        """Axes that no control moves."""
        return tuple(axis for axis, each in self.authority.items() if max(map(abs, each.values())) < LEAST)

    def problems(self) -> Iterator[str]:
        """One line for each thing that is wrong."""
        frame = self.robot.wings
        cruise = next((each for each in self.tried if each.speed == frame.speed), self.tried[0])
        if cruise.trim is None:
            yield cruise.missing
        elif cruise.speed == frame.speed and abs(math.degrees(cruise.trim.alpha)) > frame.stall_deg:
            yield (
                f"'airframe.speed' = {frame.speed:g} m/s asks for an angle of attack of "
                f"{math.degrees(cruise.trim.alpha):.1f}°, beyond 'airframe.stall_deg' = {frame.stall_deg:g}°."
            )
        flown = [
            each for each in self.tried if each.trim and abs(math.degrees(each.trim.alpha)) <= frame.stall_deg
        ]
        fastest = max(
            ((mode, at) for at in flown for mode in at.modes), key=lambda one: one[0].real, default=None
        )
        if fastest is not None and fastest[0].real > math.log(2.0) / FASTEST_S:
            mode, at = fastest
            yield (
                f"at {at.where} its {mode.name} doubles in {math.log(2.0) / mode.real:.2g} s; accepted is from "
                f"{FASTEST_S:g} s on. Look at signs and sizes in 'airframe.aerodynamics.terms', and at 'body.inertia'."
            )
        if self.authority and self.missing_axes:
            yield f"no control moves it about or along {', '.join(self.missing_axes)}."

    def as_json(self) -> dict[str, Any]:
        """What `fulmar check robot --json` has of it."""
        trims = [
            {
                "speed": trim.speed,
                "height": trim.height,
                "altitude": trim.altitude,
                "alpha_deg": math.degrees(trim.alpha),
                "elevator_deg": math.degrees(trim.elevator),
                "throttle": trim.throttle,
                "thrust_n": trim.thrust,
                "modes": [mode.as_json() for mode in modes],
            }
            for trim, modes in self.trims
        ]
        return {
            "actuators": {
                "count": len(self.robot.actuators.names),
                "rank": len(self.authority) - len(self.missing_axes),
                "missing_axes": list(self.missing_axes),
                "axes": list(self.authority),
                "authority": self.authority,
            },
            "zero_wrench_holdable": bool(self.trims),
            "controllable": bool(self.trims) and not self.missing_axes,
            "trim": trims,
            "tried": [each.as_json(self.altitude) for each in self.tried],
        }

    def lines(self) -> list[tuple[str, str]]:
        """What people read, as labels and texts."""
        lines = []
        for axis, each in self.authority.items():
            strongest = sorted(each.items(), key=lambda one: -abs(one[1]))
            most = abs(strongest[0][1])
            shown = [f"{name} {value:+.3g}" for name, value in strongest if abs(value) > 0.05 * most]
            lines.append((f"full control, {axis}", f"{', '.join(shown)} {UNITS[axis]}"))
        for at in self.tried:
            trim = at.trim
            if trim is None:
                lines.append((at.where, f"no trim: {at.missing}"))
                continue
            lines.append(
                (
                    at.where,
                    f"trims: α {math.degrees(trim.alpha):.2f}°, elevator {math.degrees(trim.elevator):.2f}°, throttle "
                    f"{trim.throttle:.3f}, thrust {trim.thrust:.4g} N",
                )
            )
            lines += [("", _mode_line(mode)) for mode in at.modes]
        return lines


def check_aircraft(
    robot: Robot, *, speed: float | None = None, altitude: float | None = None, height: float | None = None
) -> AircraftCheck:
    """Trim and linearise an aircraft.

    Args:
        robot: An aircraft.
        speed: Through the air; None: five around its cruising speed [m/s].
        altitude: Above mean sea level, of the craft in free air, else of the ground; None: 0 [m].
        height: Of the craft above the ground, with ground effect; None: free air, and, without a speed, some heights
            at cruise too [m].

    Raises:
        ConfigError: There is no trim at the speed or height that was asked for, or none at all.
    """
    frame = robot.airframe
    assert frame is not None  # of every aircraft
    cruise = frame.speed
    asked = [(speed, height)] if speed is not None else [(share * cruise, height) for share in SPEEDS]
    if speed is None and height is None and frame.ground_effect is not None:
        asked += [(cruise, share * frame.span) for share in HEIGHTS]
    tried = []
    for at_speed, at_height in asked:
        try:
            trim = find_trim(robot, at_speed, at_height, altitude or 0.0)
        except ConfigError as error:
            if speed is not None:
                raise
            tried.append(Tried(at_speed, at_height, missing=str(error)))
            continue
        tried.append(Tried(at_speed, at_height, trim, modes_of(robot, trim)))
    found = [each.trim for each in tried if each.trim is not None]
    authority = _authority(robot, found[len(found) // 2]) if found else {}
    return AircraftCheck(robot, tuple(tried), altitude or 0.0, authority)


def _authority(robot: Robot, trim: Trim) -> dict[str, dict[str, float]]:
    _, effects = continuous_model(robot, trim)
    full = effects * robot.actuators.scale
    names = robot.actuators.names
    return {axis: dict(zip(names, map(float, full[row]), strict=True)) for axis, row in AXES.items()}


def _mode_line(mode: Mode) -> str:
    if mode.imag:
        period = 2.0 * math.pi / mode.imag
        return f"{mode.name}: {mode.frequency:.3g} rad/s, damping {mode.damping:.3g}, period {period:.3g} s"
    kind = "time constant" if mode.real < 0.0 else "doubles in"
    seconds = -1.0 / mode.real if mode.real < 0.0 else math.log(2.0) / mode.real
    return f"{mode.name}: {mode.real:.3g} 1/s, {kind} {seconds:.3g} s"
