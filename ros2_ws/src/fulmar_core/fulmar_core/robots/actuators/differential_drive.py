"""Two driven wheels on one axle, commanded by speed and turn rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from array_api_compat import device

from fulmar_core.config.plausible_ranges import Plausible
from fulmar_core.robots.actuators.parts import MovingParts
from fulmar_core.robots.actuators.response import Response
from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.rotation import Array


@dataclass(frozen=True)
class DifferentialDrive(Rolling):
    """A command is (speed ahead [m/s], turn rate [rad/s]), turning left counted positive (REP-103)."""

    kind: Literal["differential_drive"]
    wheel_radius: float  # [m]
    track: float  # between the wheels' contact points [m]
    max_speed: float  # of the body, ahead and astern [m/s]
    max_yaw_rate: float  # [rad/s]
    max_wheel_speed: float  # [rad/s]
    wheel_force: float  # the most that one wheel pushes: motor or friction, whichever is less [N]
    friction: float  # of the tyres on the floor [-]
    caster_x: float  # where the casters are, ahead and behind the axle; negative: behind alone [m]
    response: Response = Response()

    takes_velocity = True
    calibrated = ("wheel_scale", "turn_scale", "lag", "delay")
    plausible = (
        *Rolling.plausible,
        Plausible(
            "actuators.max_wheel_speed", "rad/s", (0.98, 6.0), (0.99, 3.0), "of max_speed / wheel_radius",
            scale=lambda robot: robot.actuators.max_speed / robot.actuators.wheel_radius,
        ),
        Plausible(
            "actuators.max_yaw_rate", "rad/s", (0.01, 1.2), (0.03, 1.01), "of a turn on the spot at max_wheel_speed",
            scale=lambda robot: robot.actuators.fastest_turn,
        ),
        Plausible(
            "actuators.caster_x", "m", (-1.5, 1.5), (-1.05, 1.05), "of the radius: casters stand within the outline",
            scale=lambda robot: robot.body.radius,
        ),
    )  # fmt: skip

    def __post_init__(self) -> None:
        positive = (
            self.wheel_radius, self.track, self.max_speed, self.max_yaw_rate,
            self.max_wheel_speed, self.wheel_force, self.friction,
        )  # fmt: skip
        if min(positive) <= 0.0:
            raise ValueError("sizes, speeds, force and friction must be greater than 0.")
        if self.response.slew and len(self.response.slew) != 2:
            raise ValueError("'slew' needs two values: of the speed and of the turn rate.")

    @property
    def units(self) -> tuple[str, ...]:
        """Of the two commands; see `Actuators.units`."""
        return ("m/s", "rad/s")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of a command's entries."""
        return "speed", "turn_rate"

    @property
    def wheels(self) -> dict[str, tuple[float, float]]:
        """See `Rolling.wheels`."""
        half = 0.5 * self.track
        return {"left_wheel": (0.0, half), "right_wheel": (0.0, -half)}

    @property
    def casters(self) -> dict[str, float]:
        """See `Rolling.casters`."""
        rear = {"rear_caster": -abs(self.caster_x)}
        return rear | {"front_caster": self.caster_x} if self.caster_x > 0.0 else rear

    @property
    def scale(self) -> np.ndarray:
        """Largest command [m/s, rad/s]."""
        return np.array([self.max_speed, self.max_yaw_rate])

    @property
    def parts(self) -> MovingParts:
        """The wheels, which turn by the speed and the turn rate of the body; see `Actuators.parts`."""
        half, most = 0.5 * self.track, np.full(2, self.max_wheel_speed)
        matrix = np.array([[1.0, -half], [1.0, half]]) / self.wheel_radius
        return MovingParts(tuple(self.wheels), -most, most, matrix)

    def limited(self, command: Array) -> Array:
        """Nearest command that the wheels can carry out, shape (..., 2).

        Where the wheels cannot turn fast enough, speed and turn rate shrink alike, so that the path stays.
        """
        xp = array_namespace(command)
        most = xp.asarray(self.scale, dtype=command.dtype, device=device(command))
        within = clip(command, -most, most)
        outer = xp.abs(within[..., 0:1]) + 0.5 * self.track * xp.abs(within[..., 1:2])
        return within / clip(outer / (self.max_wheel_speed * self.wheel_radius), 1.0, None)

    @property
    def fastest_turn(self) -> float:
        """On the spot, with the wheels at their top speed [rad/s]."""
        return 2.0 * self.max_wheel_speed * self.wheel_radius / self.track

    @property
    def largest_yaw_rate(self) -> float | None:
        """See `Actuators.largest_yaw_rate` [rad/s]."""
        return self.max_yaw_rate

    @property
    def pull(self) -> float:
        """The most that both wheels push together [N]."""
        return 2.0 * self.wheel_force

    @property
    def full_wrenches(self) -> tuple[np.ndarray, np.ndarray, bool]:
        """Of each side: they push against one another too; see `Actuators.full_wrenches`."""
        sides = [[1.0, 0.0, 0.0, 0.0, 0.0, side * 0.5 * self.track] for side in (-1.0, 1.0)]
        return self.wheel_force * np.array(sides), -np.ones(2), False

    def next_yaw_rate(
        self, state: PlanarState, speed: Array, turn: Array, twist: Array, yaw_inertia: Array, dt: float
    ) -> Array:
        """The turn rate follows its servo as hard as wheels push; see `Rolling.next_yaw_rate`."""
        fastest = self.wheel_force * self.track / yaw_inertia
        twist = twist / yaw_inertia
        turning = clip((turn - state.yaw_rate) / self.servo_s, twist - fastest, twist + fastest)
        return state.yaw_rate + dt * turning

    def turned(self) -> np.ndarray | None:
        """It drives astern as it drives ahead; see `Actuators.turned`."""
        return np.diag([-1.0, 1.0])

    def wheel_speeds(self, command: Array) -> Array:
        """Speeds of the left and the right wheel.

        Args:
            command: Shape (..., 2) [m/s, rad/s].

        Returns:
            Shape (..., 2) [rad/s].
        """
        xp = array_namespace(command)
        speed, turn = command[..., 0], 0.5 * self.track * command[..., 1]
        return xp.stack((speed - turn, speed + turn), axis=-1) / self.wheel_radius
