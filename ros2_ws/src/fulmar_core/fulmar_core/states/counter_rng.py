"""Random numbers by counter: every number is a function of what it is for, never of what was drawn before.

World w of a batch depends on (seed, number of the world, how often it began anew, stream) alone, so it gets the same
numbers among 64 worlds and among 4,096. Each number is a 32-bit hash of its counters; the mixing function is
`lowbias32` of C. Wellons' hash-prospector (public domain, bias below 0.2 %). Not for cryptography.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from array_api_compat import device

from fulmar_core.states.arrays import array_namespace, is_numpy
from fulmar_core.states.rotation import Array

START, NOISE, WORLD = 0, 1, 2  # streams that do not disturb one another
MASK = 0xFFFFFFFF
GOLDEN = 0x9E3779B9  # 2³² / golden ratio: neighbouring counters become far apart
OTHER = 0x85EBCA6B  # an odd number that shares nothing with it

BLOCK = 64  # numbers of a world that `Draws` makes at once

Keys = tuple[Array, Array]  # two words for each world, shapes (n,)


def world_keys(seed: int, numbers: Array, repeats: Array, stream: int) -> Keys:
    """Keys that the numbers of some worlds follow from.

    Args:
        seed: Seed of the run, >= 0.
        numbers: Number of each world or episode, shape (n,), integers >= 0.
        repeats: How often each has begun anew, shape (n,), integers >= 0.
        stream: What for: START, WORLD or NOISE.
    """
    n, r = _counter(numbers), _counter(repeats)
    odd, start = _beginnings(seed, stream, array_namespace(n), n.dtype, device(n))
    first, second = _mix(_low(_mix(_low(n * odd + start)) + r * GOLDEN))
    return first, second


@functools.lru_cache(maxsize=64)
def _beginnings(seed: int, stream: int, xp: Any, dtype: Any, where: Any) -> tuple[Array, Array]:
    """What numbers of worlds are multiplied with, and what is added, for both keys, shapes (2, 1)."""
    odds = GOLDEN, OTHER
    starts = [
        _mix_number(_mix_number((seed & MASK) ^ odd) ^ (seed >> 32 & MASK) ^ (stream * odd & MASK))
        for odd in odds
    ]
    odd, start = (xp.asarray(both, dtype=dtype, device=where)[:, None] for both in (odds, starts))
    return odd, start


def keys_at(keys: Keys, index: Any) -> Keys:
    """Those of some worlds."""
    first, second = keys
    return first[index], second[index]


def write_keys(keys: Keys, index: Any, new: Keys) -> None:
    """Overwrite those of some worlds in place."""
    for every, some in zip(keys, new, strict=True):
        every[index] = some


def words(keys: Keys, counter: Array | int, count: int) -> Array:
    """Hash counters to words.

    Args:
        keys: Of the worlds.
        counter: Such as the step of an episode: one number, or one for each world, shape (n,).
        count: How many words for each world.

    Returns:
        Words in [0, 2³²), shape (count, n): numbers of one kind lie together.
    """
    first, second = (_counter(key) for key in keys)
    xp = array_namespace(first)
    here = counter * OTHER & MASK if isinstance(counter, int) else _low(_counter(counter) * OTHER)
    base = _mix(_low(first + here)) ^ second
    return _mix(_low(base[None, :] + _channels(count, xp, base.dtype, device(base))))


@functools.lru_cache(maxsize=64)
def _channels(count: int, xp: Any, dtype: Any, where: Any) -> Array:
    """By which the words of one counter differ, shape (count, 1)."""
    return xp.asarray([(i + 1) * GOLDEN & MASK for i in range(count)], dtype=dtype, device=where)[:, None]


def uniform_from(bits: Array, dtype: Any) -> Array:
    """Words as numbers in (0, 1), same shape; float32 may round the largest up to 1."""
    unit = array_namespace(bits).astype(bits, dtype)
    unit += 0.5
    unit *= 2.0**-32
    return unit


def normal_from(bits: Array, dtype: Any) -> Array:
    """Words, shape (2k, n), as standard normal numbers of a floating type, pair by pair (Box and Muller 1958)."""
    xp = array_namespace(bits)
    unit = uniform_from(bits, dtype)
    half = bits.shape[0] // 2
    radius = xp.sqrt(-2.0 * xp.log(unit[:half]))
    angle = 2.0 * math.pi * unit[half:]
    return xp.concat((radius * xp.cos(angle), radius * xp.sin(angle)), axis=0)


class Draws:
    """Numbers for some worlds, in an order that the code fixes; what an episode is drawn from."""

    def __init__(self, seed: int, numbers: Array, repeats: Array, stream: int = START) -> None:
        """Prepare the worlds; arguments as in `world_keys`."""
        self._keys = world_keys(seed, numbers, repeats, stream)
        self._blocks, self._used = 0, BLOCK
        self._pool: Array = None
        self.worlds = int(self._keys[0].shape[0])

    @classmethod
    def of_episode(cls, seed: int, number: int, *, repeat: int = 0, stream: int = START) -> Draws:
        """The numbers of one episode, as a batch of one."""
        return cls(seed, np.asarray([number]), np.asarray([repeat]), stream)

    def branch(self, number: int) -> Draws:
        """Other numbers for the same worlds, which leave these as they are; each branch has a `number` >= 1."""
        other = object.__new__(type(self))
        first, second = words(self._keys, MASK - number, 2)
        other._keys, other.worlds = (first, second), self.worlds
        other._blocks, other._used, other._pool = 0, BLOCK, None
        return other

    def uniform(self, low: Any, high: Any, *shape: int) -> Array:
        """Numbers between two bounds, which may broadcast, shape (worlds, *shape), float64."""
        return low + (high - low) * self._unit(shape)

    def normal(self, std: Any, *shape: int) -> Array:
        """Normal numbers about zero, shape (worlds, *shape), float64."""
        radius, turn = self._unit(shape), self._unit(shape)
        xp = array_namespace(radius)
        return std * xp.sqrt(-2.0 * xp.log(radius)) * xp.cos(2.0 * math.pi * turn)

    def _unit(self, shape: tuple[int, ...]) -> Array:
        count = math.prod(shape)
        if self._used + count > (BLOCK if self._pool is None else self._pool.shape[0]):
            self._refill(max(BLOCK, count))
        unit = self._pool[self._used : self._used + count]
        self._used += count
        return array_namespace(unit).reshape(unit.T, (self.worlds, *shape))

    def _refill(self, count: int) -> None:
        """Hash many counters at once: for a few worlds the calls cost more than the numbers."""
        bits = words(self._keys, self._blocks, count)
        self._pool = uniform_from(bits, array_namespace(bits).float64)
        self._blocks, self._used = self._blocks + 1, 0


def _counter(values: Array) -> Array:
    """Integers as words: 32-bit where the library can compute with them, else the low half of 64."""
    if is_numpy(values):
        return np.asarray(values).astype(np.uint32, copy=False)
    xp = array_namespace(values)
    return xp.astype(values, xp.int64) & MASK


def _mix(x: Array) -> Array:
    x = x ^ (x >> 16)
    x *= 0x7FEB352D
    x = _low(x)
    x ^= x >> 15
    x *= 0x846CA68B
    x = _low(x)
    x ^= x >> 16
    return x


def _low(x: Array) -> Array:
    """The low half of words; those of 32 bits have no other."""
    return x if is_numpy(x) else x & MASK


def _mix_number(x: int) -> int:
    x = (x ^ (x >> 16)) * 0x7FEB352D & MASK
    x = (x ^ (x >> 15)) * 0x846CA68B & MASK
    return x ^ (x >> 16)
