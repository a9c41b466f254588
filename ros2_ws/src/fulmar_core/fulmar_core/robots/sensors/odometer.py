"""Pose and velocity as a motion-capture or odometry source reports them: the same code in training and on ROS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Generic, Protocol

import numpy as np
from array_api_compat import device

from fulmar_core.robots.sensors.kind import SensorKind
from fulmar_core.states.arrays import array_namespace, clip, is_numpy
from fulmar_core.states.counter_rng import (
    NOISE,
    Keys,
    keys_at,
    normal_from,
    uniform_from,
    words,
    world_keys,
    write_keys,
)
from fulmar_core.states.mutable_state import MutableState
from fulmar_core.states.rotation import Array, wrap_angle
from fulmar_core.states.state import S
from fulmar_core.wires.wire import Wire


class SensorErrors(Protocol):
    """What differs in the odometry of worlds, see `worlds.world.World`."""

    @property
    def dropout(self) -> Array:
        """Chance that a measurement is lost [-]."""

    @property
    def sensor_delay(self) -> Array:
        """Beyond the sensor's own [s]."""


@dataclass(frozen=True)
class Channel:
    """How one measured quantity differs from the true one; 0 switches a part off."""

    std: float = 0.0  # white noise, anew with each measurement
    bias_std: float = 0.0  # of a bias that stays for an episode
    scale_std: float = 0.0  # of a scale error that stays for an episode [-]
    limit: float = 0.0  # readings are cut to ± this
    quantum: float = 0.0  # readings are whole multiples of this

    def __post_init__(self) -> None:
        if min(self.std, self.bias_std, self.scale_std, self.limit, self.quantum) < 0.0:
            raise ValueError("std, bias_std, scale_std, limit and quantum must not be negative.")


def largest_reading(limit: Array, quantum: Array) -> Array:
    """The last whole quantum within the limit, for channels of any shape; 0 of either is none."""
    xp = array_namespace(limit)
    step = xp.where(quantum > 0.0, quantum, xp.ones_like(quantum))
    within = xp.where(quantum > 0.0, xp.floor(limit / step + 1e-6) * step, limit)
    return xp.where(limit > 0.0, within, xp.full_like(limit, xp.inf))


@dataclass(frozen=True)
class OdometrySpec:
    """What the odometry reports, and when."""

    position: Channel = Channel()  # each world axis [m]
    heading: Channel = Channel()  # [rad]
    velocity: Channel = Channel()  # each world axis [m/s]
    yaw_rate: Channel = Channel()  # [rad/s]
    rate_hz: float = 0.0  # new readings; 0: at every plant tick [Hz]
    delay_s: float = 0.0  # from motion to reading [s]

    def __post_init__(self) -> None:
        if min(self.rate_hz, self.delay_s) < 0.0:
            raise ValueError("rate_hz and delay_s must not be negative.")


AHEAD = (
    64  # measurements of a lone world whose numbers are drawn at once: the calls cost more than the numbers
)


@dataclass(frozen=True, slots=True)
class Drawn:
    """What is random in one measurement of each world, or in some measurements of one."""

    bits: Array  # words, shape (words, n)
    normal: Array | None  # standard normal numbers of the channels, shape (k, n); None: no channel is noisy

    def at(self, index: int) -> Drawn:
        """One measurement out of some, as a batch of one."""
        normal = None if self.normal is None else self.normal[:, index : index + 1]
        return Drawn(self.bits[:, index : index + 1], normal)


@dataclass(frozen=True, slots=True)
class FirstReading:
    """What is measured before the first step, and what the noise of all later measurements hangs on."""

    columns: Array  # (6, n)
    keys: Keys

    def write(self, index: Array, other: FirstReading) -> None:
        """Overwrite some worlds in place."""
        self.columns[:, index] = other.columns
        write_keys(self.keys, index, other.keys)


class Odometer(MutableState, Generic[S]):
    """Measures a batch of worlds, once every `period` seconds; remembers what it held back."""

    MUTABLE = ("_past", "_held", "_keys")
    LOST = 6  # which random word of a measurement says whether it is lost
    WORDS, BLURRED_WORDS = 7, 10  # random words for a measurement of one world; with velocities that err

    def __init__(
        self,
        spec: OdometrySpec,
        *,
        seed: int,
        period: float,
        max_delay_s: float = 0.0,
        noisy: bool = True,
        blurred: bool = False,
    ) -> None:
        """Prepare.

        Args:
            spec: What differs from the truth.
            seed: Seed of the noise.
            period: Time between two calls of `measure` [s].
            max_delay_s: Longest delay that worlds add to the spec's own [s].
            noisy: False: perfect, and at once.
            blurred: Whether worlds have velocity noise of their own, which perfect sensors have too.
        """
        spec = spec if noisy else OdometrySpec()
        self._spec, self._seed, self._noisy, self._period = spec, seed, noisy, period
        self._channels = self.channels(spec)
        self._blurred = blurred
        # Of the calls that bring a new reading.
        self._share = min(1.0, spec.rate_hz * period) if spec.rate_hz else 1.0
        # An error of scale, or a limit, is of the angle that a sensor gives, not of all turns so far.
        self._wraps = max(spec.heading.scale_std, spec.heading.limit) > 0.0
        longest = spec.delay_s + max_delay_s if noisy else 0.0
        self._depth = int(np.ceil(longest / period - 1e-9)) + 1 if longest > 0.0 else 1
        self._constants: dict[str, Array] = {}
        self._used = {part for part in Channel.__dataclass_fields__ if np.any(self._column(part) != 0.0)}
        self._past: list[Array] = []  # readings, newest first
        self._held: Array | None = None
        self._keys: Keys | None = None
        self._ahead: tuple[Keys, int, Drawn] | None = None  # of which keys, from which measurement on

    def take(self, state: dict[str, Any]) -> None:
        """See `MutableState.take`."""
        super().take(state)
        self._ahead = None

    def measure(
        self,
        truth: S,
        world: SensorErrors,
        numbers: Array,
        repeats: Array,
        steps: Array,
    ) -> S:
        """What is reported now; no world may have begun anew since the last call but by `restart`.

        Args:
            truth: True state, shapes (n,).
            world: Noise factors, biases, delays and losses.
            numbers: Number of each world, shape (n,).
            repeats: How often each began anew, shape (n,).
            steps: How many measurements each had in this episode, shape (n,); 0 forgets its past.

        Returns:
            Measured state, shapes (n,).
        """
        if self._perfect:
            return truth
        return self._state(truth, self.measure_columns(self._columns(truth), world, numbers, repeats, steps))

    def measure_columns(
        self, columns: Array, world: SensorErrors, numbers: Array, repeats: Array, steps: Array
    ) -> Array:
        """The same of the columns of the true state, shape (k, n), of sensors that err; not to be changed."""
        xp = array_namespace(columns)
        if self._keys is None:
            self._keys = world_keys(self._seed, numbers, repeats, NOISE)
        drawn = self._drawn_at(self._keys, steps, columns)
        reading = self._disturbed(columns, world, drawn)
        if self._depth > 1:
            reading = self._delayed(reading, world)
        lost = uniform_from(drawn.bits[self.LOST], columns.dtype) < (world.dropout if self._noisy else 0.0)
        if self._share < 1.0:
            due = xp.astype(steps, columns.dtype) * self._share + 1e-4
            lost = lost | (xp.floor(due) == xp.floor(due - self._share))
        if self._held is not None:
            reading = xp.where(lost & (steps != 0), self._held, reading)
        self._held = reading
        return reading

    def _drawn_at(self, keys: Keys, steps: Array, like: Array) -> Drawn:
        """What is random in the measurements of these numbers."""
        if len(steps) > 1 or not is_numpy(steps):
            return self._drawn(keys, steps, like)
        step = int(steps[0])
        if self._ahead is None or self._ahead[0] is not keys or not 0 <= step - self._ahead[1] < AHEAD:
            self._ahead = keys, step, self._drawn(keys, np.arange(step, step + AHEAD), like)
        return self._ahead[2].at(step - self._ahead[1])

    def _drawn(self, keys: Keys, steps: Array | int, like: Array) -> Drawn:
        bits = words(keys, steps, self._words)
        noisy = "std" in self._used
        return Drawn(bits, normal_from(bits[: len(self._channels)], like.dtype) if noisy else None)

    def first(self, truth: S, world: SensorErrors, numbers: Array, repeats: Array) -> FirstReading:
        """First measurement of episodes that are to begin; arguments as in `measure`. Changes nothing."""
        keys = world_keys(self._seed, numbers, repeats, NOISE)
        columns = self._columns(truth)
        if not self._perfect:
            columns = self._disturbed(columns, world, self._drawn(keys, 0, columns))
        return FirstReading(columns, keys)

    def restart(self, truth: S, which: Array, first: FirstReading) -> S:
        """Forget the past of some worlds, in whose place `first` is reported.

        Args:
            truth: True state of all worlds, shapes (n,).
            which: Numbers of the worlds that begin anew.
            first: First readings of all worlds, of which theirs count.

        Returns:
            Measured state, shapes (n,); the other worlds keep what they had.
        """
        if self._perfect:
            return truth
        assert self._held is not None and self._keys is not None
        write_keys(self._keys, which, keys_at(first.keys, which))
        self._ahead = None
        # Who was given readings keeps them; what is still under way nobody was given.
        self._held = array_namespace(self._held).asarray(self._held, copy=True)
        for old in (self._held, *self._past):
            old[:, which] = first.columns[:, which]
        return self._state(truth, self._held)

    @property
    def _perfect(self) -> bool:
        return not (self._noisy or self._blurred)

    @staticmethod
    def channels(spec: OdometrySpec) -> tuple[Channel, ...]:
        """Of x, y, yaw, v_x, v_y and the turn rate."""
        return spec.position, spec.position, spec.heading, spec.velocity, spec.velocity, spec.yaw_rate

    @property
    def _words(self) -> int:
        return self.BLURRED_WORDS if self._blurred else self.WORDS

    def _column(self, part: str) -> np.ndarray:
        """One number of each channel, shape (k, 1)."""
        return np.array([[getattr(channel, part)] for channel in self._channels])

    def _constant(self, part: str, like: Array) -> Array:
        if part not in self._constants:
            xp = array_namespace(like)
            self._constants[part] = xp.asarray(self._column(part), dtype=like.dtype, device=device(like))
        return self._constants[part]

    def _disturbed(self, columns: Array, world: Any, drawn: Drawn) -> Array:
        """Columns, shape (6, n), with the errors that worlds (`World`) have, and with random ones."""
        xp = array_namespace(columns)
        if self._wraps:
            columns = xp.stack([wrap_angle(column) if i == 2 else column for i, column in enumerate(columns)])
        if "scale_std" in self._used:
            columns = columns * (1.0 + self._constant("scale_std", columns) * world.sensor_scale)
        if "bias_std" in self._used:
            columns = columns + self._constant("bias_std", columns) * world.sensor_bias
        if "std" in self._used:
            noise = drawn.normal * world.noise
            columns = columns + self._constant("std", columns) * noise
        if self._blurred:
            share = 2.0 * uniform_from(drawn.bits[7:10], columns.dtype) - 1.0
            error = (
                world.velocity_noise * share[0],
                world.velocity_noise * share[1],
                world.yaw_rate_noise * share[2],
            )
            columns = xp.stack(
                (*(columns[i] for i in range(3)), *(columns[3 + i] + error[i] for i in range(3)))
            )
        if "limit" in self._used:
            most = self._most(columns)
            columns = clip(columns, -most, most)
        if "quantum" in self._used:
            quantum = self._constant("quantum", columns)
            safe = xp.where(quantum > 0.0, quantum, xp.ones_like(quantum))
            columns = xp.where(quantum > 0.0, xp.round(columns / safe) * safe, columns)
        return columns

    def _most(self, like: Array) -> Array:
        """Largest reading of each channel, shape (6, 1)."""
        return largest_reading(self._constant("limit", like), self._constant("quantum", like))

    def _delayed(self, reading: Array, world: SensorErrors) -> Array:
        """Reading of some measurements ago; before the first one, the first."""
        xp = array_namespace(reading)
        self._past = [reading, *(self._past or [reading] * self._depth)][: self._depth]
        late = (self._spec.delay_s + world.sensor_delay) / self._period
        back = xp.round(clip(late, 0.0, self._depth - 1.0))
        chosen = self._past[0]
        for age, old in enumerate(self._past[1:], start=1):
            chosen = xp.where(back == age, old, chosen)
        return chosen

    @staticmethod
    def _columns(state: S) -> Array:
        """What is measured, shape (6, n)."""
        return array_namespace(state.like).stack(state.columns())

    @staticmethod
    def _state(truth: S, columns: Array) -> S:
        """A state in the form of the true one; its arrays are rows of the columns."""
        return type(truth)(*(columns[i] for i in range(columns.shape[0])))


KIND = SensorKind(
    spec=OdometrySpec,
    wire=Wire(
        "odom", "nav_msgs/msg/Odometry", "plant", "stream", "every plant tick",
        "measured pose and twist, stamped at measurement", unit="m, m/s, rad/s",
        frame="`odom`; twist in `base_link`",
    ),
    frame="odom",
    message=None,
    simulate=None,  # part of the batch, as an `Odometer`
)  # fmt: skip
