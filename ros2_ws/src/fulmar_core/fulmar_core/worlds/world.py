"""One draw of a scenario for each world, constant during an episode, and the push that follows from it."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any, Self

from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.rotation import Array

_NAMES: dict[type, tuple[str, ...]] = {}  # of the fields of each kind of `Drawn` that was met


@dataclass(frozen=True, slots=True)
class Drawn:
    """What is drawn for episodes, world axis last: fields of the shape (...,), or (k, ...) with rows of their own."""

    # As in `packed`: every number, and how many rows each field has; 0: one, without an axis for it.
    _packing: tuple[Array, tuple[int, ...]] | None = field(
        init=False, repr=False, compare=False, default=None
    )

    @property
    def strength(self) -> Array | float:
        """Factor on the thrust, and with it on the gas, of all actuators of each world's body, shape (...,) [-]."""
        return 1.0

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Names of the fields, in the order of the constructor."""
        if cls not in _NAMES:
            _NAMES[cls] = tuple(f.name for f in fields(cls) if f.init)
        return _NAMES[cls]

    def parts(self) -> tuple[Array, ...]:
        """Every field, in the order of `names`."""
        return tuple(getattr(self, name) for name in self.names())

    def packed(self) -> Self:
        """The same with all its numbers in one array: worlds that begin anew cost one call of it, not one for each."""
        parts = self.parts()
        xp, axes = array_namespace(parts[0]), parts[0].ndim
        block = xp.concat([part if part.ndim > axes else part[None] for part in parts])
        return self._unpacked(block, tuple(part.shape[0] if part.ndim > axes else 0 for part in parts))

    @classmethod
    def _unpacked(cls, block: Array, rows: tuple[int, ...]) -> Self:
        """Fields that are views of an array, shape (all rows, ...)."""
        starts = itertools.accumulate((max(1, count) for count in rows), initial=0)
        drawn = cls(
            *(block[at : at + count] if count else block[at] for at, count in zip(starts, rows, strict=False))
        )
        object.__setattr__(drawn, "_packing", (block, rows))
        return drawn

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies of a packed one are packed; their numbers stay views of one array."""
        if self._packing is None:
            return type(self), self.parts()
        return self._unpacked, self._packing

    def __getitem__(self, index: Any) -> Self:
        """Pick worlds out of a batch."""
        if self._packing is not None:
            block, rows = self._packing
            return self._unpacked(block[..., index], rows)
        return self.mapped(lambda part: part[..., index])

    def write(self, index: Any, other: Self) -> None:
        """Overwrite some worlds of a batch in place."""
        if self._packing is not None and other._packing is not None:
            self._packing[0][..., index] = other._packing[0]
            return
        for mine, theirs in zip(self.parts(), other.parts(), strict=True):
            mine[..., index] = theirs

    def adopt(self, index: Any, other: Self) -> None:
        """Overwrite some worlds by the same ones of another batch, in place; both are packed.

        Worlds that were picked out first, for `write`, cost a view of each field, which takes longer than the copy.
        """
        assert self._packing is not None and other._packing is not None
        self._packing[0][..., index] = other._packing[0][..., index]

    def in_numbers(self) -> Self:
        """The same of one world, shapes (1,) and (k, 1), in plain numbers and lists of them."""
        return self.mapped(lambda part: part[..., 0].tolist())

    def mapped(self, change: Callable[[Array], Array]) -> Self:
        """The same with every array changed; not packed."""
        return type(self)(*map(change, self.parts()))


@dataclass(frozen=True, slots=True)
class World(Drawn):
    """Body, actuators, surroundings and sensors of episodes in the plane.

    Arrays have the shape (...,), those of actuators (n, ...), those of measured columns (6, ...).
    """

    mass: Array  # [kg]
    yaw_inertia: Array  # [kg·m²]
    com_x: Array  # centre of mass ahead of the body's origin [m]
    com_y: Array  # to its left [m]
    drag: Array  # factor on the damping of the water [-]
    gain: Array  # (n, ...) factor on what each actuator does [-]
    alive: Array  # (n, ...) 1, or 0 for an actuator that stays closed or still [-]
    action_noise: Array  # largest error of an actuator, of full command, anew at each control step [-]
    action_delay: Array  # until a command acts, beyond the actuators' own [s]
    opening_delay: Array  # until a valve that was closed is open, beyond that; it closes without it [s]
    force_x: Array  # constant, in the world [N]
    force_y: Array  # [N]
    torque: Array  # constant [N·m]
    wave_force: Array  # amplitude of a force that is sinusoidal in the place (an uneven floor) [N]
    wave_torque: Array  # same for the torque [N·m]
    wave_number: Array  # [rad/m]
    wave_phase_x: Array  # [rad]
    wave_phase_y: Array  # [rad]
    tether_stiffness: Array  # pull of an air line per metre that its end is away from the anchor [N/m]
    tether_x: Array  # where the line is fastened, ahead of the body's origin [m]
    tether_y: Array  # to its left [m]
    anchor_x: Array  # what the line hangs from, in the world [m]
    anchor_y: Array  # [m]
    kick: Array  # force of a kick that lasts one control step [N]
    kick_period: Array  # from kick to kick [s]
    kick_direction: Array  # [rad]
    noise: Array  # factor on the sensors' noise [-]
    velocity_noise: Array  # largest error of each measured velocity, anew with each measurement [m/s]
    yaw_rate_noise: Array  # same for the turn rate [rad/s]
    sensor_bias: Array  # (6, ...) in the sensors' own standard deviations of bias [-]
    sensor_scale: Array  # (6, ...) in the sensors' own standard deviations of scale [-]
    sensor_delay: Array  # beyond the sensors' own [s]
    dropout: Array  # chance that a measurement is lost [-]
    stuck_part: Array  # number of the part that sticks within the episode; -1: none
    stuck_at: Array  # where it sticks, as a share of its largest value [-]
    stuck_from: Array  # from when on; out of reach where none sticks [s]
    supply_left: Array  # share of the supply that is left in the end; 1: it does not fall [-]
    supply_from: Array  # when it begins to fall [s]
    supply_over: Array  # how long it falls [s]
    tank_fill: Array  # pressure of the tank at the start, by that of the full one [-]


FIELDS = World.names()


def outside_wrench(
    state: PlanarState, world: World, time_s: Array, control_dt: float
) -> tuple[Array, Array, Array]:
    """External push on the body, held over a control step, in which a robot moves a few centimetres.

    Args:
        state: Where the body is.
        world: What surrounds it.
        time_s: Time in each episode, shape (...,) [s].
        control_dt: Length of a kick [s].

    Returns:
        Force along the world's x [N] and y [N], and yaw moment [N·m], shapes (...,).
    """
    xp = array_namespace(state.x)
    # F = A sin(k p + phase): RANS `tasks/common_3DoF` and `cfg/task/disturbances/*`.
    across = xp.sin(world.wave_number * state.x + world.wave_phase_x)
    along = xp.sin(world.wave_number * state.y + world.wave_phase_y)
    since = time_s - world.kick_period * xp.floor(time_s / world.kick_period)
    kicking = (since < control_dt) & (time_s >= world.kick_period)
    kick = xp.where(kicking, world.kick, xp.zeros_like(world.kick))
    pull_x, pull_y, twist = _tether(state, world)
    return (
        world.force_x + world.wave_force * across + kick * xp.cos(world.kick_direction) + pull_x,
        world.force_y + world.wave_force * along + kick * xp.sin(world.kick_direction) + pull_y,
        world.torque + world.wave_torque * across + twist,
    )


def push_is_constant(world: World) -> bool:
    """Whether every world is pushed in the same way wherever its body is, at any time; of NumPy arrays."""
    changing = (world.wave_force, world.wave_torque, world.kick, world.tether_stiffness)
    return not any(part.any() for part in changing)


def _tether(state: PlanarState, world: World) -> tuple[Array, Array, Array]:
    """Pull of an air line that hangs from above, as a pendulum's: in proportion to how far its lower end is aside.

    The end is fastened beside the body's origin, so that the moment depends on the heading. The thesis (§3.5.7) says
    that the tether applies "a small torque and force", and no more.
    """
    xp = array_namespace(state.x)
    c, s = xp.cos(state.yaw), xp.sin(state.yaw)
    arm_x, arm_y = c * world.tether_x - s * world.tether_y, s * world.tether_x + c * world.tether_y
    pull_x = world.tether_stiffness * (world.anchor_x - state.x - arm_x)
    pull_y = world.tether_stiffness * (world.anchor_y - state.y - arm_y)
    return pull_x, pull_y, arm_x * pull_y - arm_y * pull_x
