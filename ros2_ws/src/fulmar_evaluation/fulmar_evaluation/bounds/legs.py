"""Time from one pose to another by a turn, a straight and a turn, each ahead or astern."""

from __future__ import annotations

import functools

import numpy as np

from fulmar_evaluation.bounds.motions import Motions
from fulmar_evaluation.bounds.surge import time_lost

MODES = np.array([1.0, -1.0, 0.0])  # how a place is passed: ahead, astern, or at rest
_TURN = 2.0 * np.pi
_BATCH = 4096  # poses at once: what a core's cache likes
_ROUNDING = 1e-6  # turns just short of a full one are none [rad]

Words = tuple[np.ndarray, ...]  # speed and turn rate of the first turn, of the last, and the straight's sign


def leg_time(
    motions: Motions,
    words: Words,
    x: np.ndarray,
    y: np.ndarray,
    turn: np.ndarray,
    modes: tuple[np.ndarray, np.ndarray] | None = None,
) -> np.ndarray:
    """Time of given turns.

    Args:
        motions: What the robot can hold.
        words: First turn and last turn, as speeds [m/s] and turn rates [rad/s], and the sign of the straight (1, -1):
            five arrays that broadcast with the poses.
        x: Where to, ahead of the robot [m].
        y: Where to, to its left [m].
        turn: Change of heading [rad].
        modes: How both ends are passed, of `MODES`; broadcast with the poses. None: stops cost nothing.

    Returns:
        Time, infinite where there is no such way [s].
    """
    first, straight, last, time = _pieces(motions, words, x, y, turn)
    if modes is None:
        return time
    v1, _, v2, _, sign = words
    signs = (np.sign(v1), np.asarray(sign), np.sign(v2))
    fits = ((modes[0] == 0.0) | (modes[0] == signs[0])) & ((modes[1] == 0.0) | (modes[1] == signs[2]))
    stops = (modes[0] == 0.0, signs[0] != signs[1], signs[1] != signs[2], modes[1] == 0.0)
    time = np.where(fits, time, np.inf)
    some = np.flatnonzero(np.logical_or.reduce(np.broadcast_arrays(time, *stops)[1:]) & np.isfinite(time))

    def picked(*values: np.ndarray) -> np.ndarray:
        return np.stack([np.broadcast_to(value, time.shape).ravel()[some] for value in values])

    flat = time.ravel()
    flat[some] += _lost(
        motions, picked(first, straight, last), picked(v1, sign, v2), picked(*stops), picked(*signs)
    )
    return flat.reshape(time.shape)


def _pieces(
    motions: Motions, words: Words, x: np.ndarray, y: np.ndarray, turn: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Lengths of the three pieces [m] and their time without stops [s].

    A turn with speed v and turn rate w goes round a centre v / w to the left. With D the vector from the first centre
    to the last and d the second distance less the first, the straight of signed length s has the heading h for which
    D = s (cos h, sin h) + d (-sin h, cos h): for each sign of s there is one.
    """
    v1, w1, v2, w2, sign = words
    r1, r2 = v1 / w1, v2 / w2
    dx = x - r2 * np.sin(turn)
    dy = y + r2 * np.cos(turn) - r1
    d = r2 - r1
    square = dx * dx + dy * dy - d * d
    length = np.sqrt(np.maximum(square, 0.0))
    heading = np.arctan2(dy, dx) - np.arctan2(d, sign * length)
    first = _turned(heading * np.sign(w1)) / np.abs(w1)
    last = _turned((turn - heading) * np.sign(w2)) / np.abs(w2)
    slow = np.where(sign > 0.0, 1.0 / motions.ahead, 1.0 / motions.astern if motions.astern else np.inf)
    with np.errstate(invalid="ignore"):
        straight = np.where(length > 0.0, length * slow, 0.0)
    time = np.where(square >= -1e-9, first + last + straight, np.inf)
    return first * np.abs(v1), length, last * np.abs(v2), time


def _turned(angle: np.ndarray) -> np.ndarray:
    """Angle in [0, 2 pi), with what rounding makes of 0 as 0."""
    angle = angle - _TURN * np.floor(angle / _TURN)
    return np.where(angle > _TURN - _ROUNDING, 0.0, angle)


def _lost(
    motions: Motions, lengths: np.ndarray, speeds: np.ndarray, stops: np.ndarray, signs: np.ndarray
) -> np.ndarray:
    """Time that stops cost; `speeds` has the sign in place of the straight's speed."""
    assert motions.surge is not None
    speeds = np.abs(speeds)
    speeds[1] = np.where(signs[1] > 0.0, motions.ahead, motions.astern)
    speeds[speeds == 0.0] = 1.0  # on the spot, where there is no way to go
    return time_lost(motions.surge, lengths, speeds, stops, signs)


@functools.lru_cache(maxsize=32)
def all_words(motions: Motions) -> np.ndarray:
    """Every pair of turns and both signs of the straight between them, shape (n, 5), those without stops first."""
    turns = motions.both_ways
    signs = (1.0, -1.0) if motions.astern else (1.0,)
    words = np.array([(*a, *b, sign) for a in turns for b in turns for sign in signs])
    stops = (np.sign(words[:, 0]) != words[:, 4]).astype(int) + (np.sign(words[:, 2]) != words[:, 4])
    return words[np.argsort(stops, kind="stable")]


def best_words(
    motions: Motions,
    x: np.ndarray,
    y: np.ndarray,
    turn: np.ndarray,
    modes: tuple[np.ndarray, np.ndarray] | None = None,
    *,
    count: int = 1,
) -> tuple[np.ndarray, np.ndarray]:
    """The fastest ways from pose to pose.

    Args:
        motions: What the robot can hold.
        x: Where to, ahead of the robot, shape (n,) [m].
        y: Where to, to its left, shape (n,) [m].
        turn: Change of heading, shape (n,) [rad].
        modes: How both ends are passed, of `MODES`, shapes (n,). None: stops cost nothing.
        count: How many ways to find.

    Returns:
        Times, shape (count, n), rising along the first axis [s], and the words' rows in `all_words`, same shape.
    """
    times = np.full((count, len(x)), np.inf)
    rows = np.zeros((count, len(x)), dtype=np.int32)
    pairs = [(b, a) for b in MODES for a in MODES] if modes is not None else [None]
    for pair in pairs:
        alike = np.arange(len(x))
        if modes is not None and pair is not None:
            alike = np.flatnonzero((modes[0] == pair[0]) & (modes[1] == pair[1]))
        for begin in range(0, len(alike), _BATCH):
            some = alike[begin : begin + _BATCH]
            times[:, some], rows[:, some] = _best(motions, x[some], y[some], turn[some], pair, count)
    return times, rows


def _best(
    motions: Motions,
    x: np.ndarray,
    y: np.ndarray,
    turn: np.ndarray,
    pair: tuple[float, float] | None,
    count: int,
) -> tuple[np.ndarray, np.ndarray]:
    """As `best_words`, for poses whose ends are passed alike."""
    times, rows = np.full((count, len(x)), np.inf), np.zeros((count, len(x)), dtype=np.int32)
    for row, word in enumerate(all_words(motions)):
        v1, _, v2, _, sign = word
        signs = np.sign([v1, sign, v2])
        if pair is not None and not (pair[0] in (0.0, signs[0]) and pair[1] in (0.0, signs[2])):
            continue
        *lengths, new = _pieces(motions, tuple(word), x, y, turn)
        some = np.flatnonzero(new < times[-1])  # stops only add to it
        if some.size == 0:
            continue
        new = new[some]
        if pair is not None:
            stops = np.array([pair[0] == 0.0, signs[0] != signs[1], signs[1] != signs[2], pair[1] == 0.0])
            if stops.any():
                new = new + _lost(
                    motions,
                    np.stack([length[some] for length in lengths]),
                    np.array([[v1], [sign], [v2]]),
                    stops[:, None],
                    signs[:, None],
                )
        number = np.full(len(some), row, dtype=np.int32)
        for i in range(count):
            old, which = times[i, some], rows[i, some]
            better = new < old
            times[i, some], new = np.where(better, new, old), np.where(better, old, new)
            rows[i, some], number = np.where(better, number, which), np.where(better, which, number)
    return times, rows
