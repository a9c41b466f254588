"""Control surfaces on servos, and propellers: what flies an aircraft.

Conventions: a command has the deflection of each surface [rad], then the throttle of each motor from 0 to 1. A positive
elevator lowers the nose, a positive aileron lowers the right wing, a positive rudder turns the nose to the left.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from array_api_compat import device

from fulmar_core.config.plausible_ranges import Plausible
from fulmar_core.robots.actuators.family import Actuators, check_names
from fulmar_core.robots.actuators.response import Response
from fulmar_core.robots.airframe.coefficients import SURFACES
from fulmar_core.robots.airframe.plausible_airframe import AIRCRAFT, derivative_ranges
from fulmar_core.robots.airframe.propulsion import ElectricMotor, PistonEngine
from fulmar_core.states.arrays import array_namespace, clip, is_numpy
from fulmar_core.states.rotation import Array

Vector3 = tuple[float, float, float]
THROTTLE = "throttle"  # how the names of motors begin


def is_throttle(name: str) -> bool:
    """Whether the name of an actuator is that of a motor, and not of a surface."""
    return name.startswith(THROTTLE)


@dataclass(frozen=True)
class Surface:
    """One control surface, or a pair that moves as one."""

    name: Literal["elevator", "aileron", "rudder"]
    limit_deg: float  # largest deflection either way [deg]
    rate_deg: float = 0.0  # fastest motion; 0: no limit [deg/s]

    def __post_init__(self) -> None:
        if not 0.0 < self.limit_deg <= 60.0 or self.rate_deg < 0.0:
            raise ValueError(
                f"'{self.name}': 'limit_deg' must lie in (0, 60] and 'rate_deg' must not be negative."
            )


@dataclass(frozen=True)
class Motor:
    """One propeller and what turns it; it pulls along the body's x axis."""

    name: str  # of its throttle
    engine: ElectricMotor | PistonEngine
    position: Vector3 = (0.0, 0.0, 0.0)  # in the body: ahead, to the left, up [m]
    lag_s: float = 0.0  # time constant of its thrust [s]
    rotation: Literal[1, -1] = 1  # 1: clockwise, seen from behind

    def __post_init__(self) -> None:
        if not is_throttle(self.name):
            raise ValueError(
                f"motor '{self.name}': its name must begin with '{THROTTLE}', as in throttle_left."
            )
        if self.lag_s < 0.0:
            raise ValueError(f"motor '{self.name}': 'lag_s' must not be negative.")


@dataclass(frozen=True)
class ControlSurfaces(Actuators):
    """Surfaces on servos of second order, and motors with a lag."""

    kind: Literal["control_surfaces"]
    surfaces: tuple[Surface, ...]
    motors: tuple[Motor, ...]
    servo_rate: float  # undamped natural rate of the servos [rad/s]
    servo_damping: float  # of them [-]
    response: Response = Response()  # only its delay and gain: servos have dynamics of their own

    flies = True
    plausible = AIRCRAFT

    def __post_init__(self) -> None:
        check_names("surfaces", "surface", [surface.name for surface in self.surfaces])
        check_names("motors", "motor", self.names)
        order = [SURFACES.index(surface.name) for surface in self.surfaces]
        if order != sorted(order):
            raise ValueError(f"'surfaces' must be in the order {', '.join(SURFACES)}.")
        if min(self.servo_rate, self.servo_damping) <= 0.0:
            raise ValueError("servo_rate and servo_damping must be greater than 0.")
        if self.response.slew or self.response.lag_s:
            raise ValueError(
                "'response' takes neither slew nor lag_s here: give servo_rate, rate_deg, and lag_s of motors."
            )

    def ranges(self, robot: Any) -> tuple[Plausible, ...]:
        """With derivatives, in the unit and the signs of the file; see `Actuators.ranges`."""
        stops: dict[str, float] = {surface.name: math.radians(surface.limit_deg) for surface in self.surfaces}
        frame = robot.airframe
        return (*self.plausible, *derivative_ranges(frame.aerodynamics, stops, math.radians(frame.stall_deg)))

    @property
    def units(self) -> tuple[str, ...]:
        """Deflections, and shares of full throttle; see `Actuators.units`."""
        return ("rad",) * self.positions + ("of full throttle",) * (len(self.names) - self.positions)

    @functools.cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the surfaces, then those of the throttles."""
        return (*(surface.name for surface in self.surfaces), *(motor.name for motor in self.motors))

    @property
    def remembers(self) -> bool:
        """See `Actuators.remembers`: servos and motors lag behind."""
        return True

    @property
    def positions(self) -> int:
        """See `Actuators.positions`: the surfaces."""
        return len(self.surfaces)

    @functools.cached_property
    def scale(self) -> np.ndarray:
        """Largest deflection [rad] or throttle of each, shape (n,)."""
        return np.array([math.radians(s.limit_deg) for s in self.surfaces] + [1.0] * len(self.motors))

    @functools.cached_property
    def lowest(self) -> np.ndarray:
        """Smallest command of each, shape (n,)."""
        low = -self.scale
        low[self.positions :] = 0.0
        return low

    @functools.cached_property
    def rates(self) -> np.ndarray:
        """Fastest motion of each surface, infinite without a limit, shape (surfaces,) [rad/s]."""
        return np.array([math.radians(s.rate_deg) if s.rate_deg else math.inf for s in self.surfaces])

    def limited(self, command: Array) -> Array:
        """Nearest command that the hardware can carry out, shape (..., n)."""
        if is_numpy(command) and command.dtype == np.float64:
            return command.clip(self.lowest, self.scale)
        xp, kwargs = array_namespace(command), {"dtype": command.dtype, "device": device(command)}
        return clip(command, xp.asarray(self.lowest, **kwargs), xp.asarray(self.scale, **kwargs))

    def servo_matrix(self, dt: float) -> np.ndarray:
        """How deviation from the command [rad] and rate [rad/s] of a servo go on in a time step, exactly, shape (2, 2).

        δ̈ = ω² (command − δ) − 2 ζ ω δ̇ with the command held (thesis §5.4.1).
        """
        from scipy.linalg import expm

        rate = self.servo_rate
        return np.asarray(expm(dt * np.array([[0.0, 1.0], [-(rate**2), -2.0 * self.servo_damping * rate]])))
