"""Time from one pose to another by a turn, a straight and a turn, each ahead or astern."""

from __future__ import annotations

import numpy as np

from fulmar_core.bounds.motions import Motions

_TURN = 2.0 * np.pi
_BATCH = 8192  # poses at once: what a core's cache likes
_ROUNDING = 1e-6  # turns just short of a full one are none [rad]


def leg_time(
    motions: Motions, words: tuple[np.ndarray, ...], x: np.ndarray, y: np.ndarray, turn: np.ndarray
) -> np.ndarray:
    """Time of given turns.

    A turn with speed v and turn rate w goes round a centre v / w to the left. With D the vector from the first centre
    to the last and d the second distance less the first, the straight of signed length s has the heading h for which
    D = s (cos h, sin h) + d (-sin h, cos h): for each sign of s there is one.

    Args:
        motions: What the robot can hold.
        words: First turn and last turn, as speeds [m/s] and turn rates [rad/s], and the sign of the straight (1, -1):
            five arrays that broadcast with the poses.
        x: Where to, ahead of the robot [m].
        y: Where to, to its left [m].
        turn: Change of heading [rad].

    Returns:
        Time, infinite where there is no such way [s].
    """
    v1, w1, v2, w2, sign = words
    r1, r2 = v1 / w1, v2 / w2
    dx = x - r2 * np.sin(turn)
    dy = y + r2 * np.cos(turn) - r1
    d = r2 - r1
    square = dx * dx + dy * dy - d * d
    length = np.sqrt(np.maximum(square, 0.0))
    heading = np.arctan2(dy, dx) - np.arctan2(d, sign * length)
    first, last = _turned(heading * np.sign(w1)), _turned((turn - heading) * np.sign(w2))
    slow = np.where(sign > 0.0, 1.0 / motions.ahead, 1.0 / motions.astern if motions.astern else np.inf)
    with np.errstate(invalid="ignore"):
        straight = np.where(length > 0.0, length * slow, 0.0)
    time = first / np.abs(w1) + last / np.abs(w2) + straight
    return np.where(square >= -1e-9, time, np.inf)


def _turned(angle: np.ndarray) -> np.ndarray:
    """Angle in [0, 2 pi), with what rounding makes of 0 as 0."""
    angle = angle - _TURN * np.floor(angle / _TURN)
    return np.where(angle > _TURN - _ROUNDING, 0.0, angle)


def all_words(motions: Motions) -> np.ndarray:
    """Every pair of turns and both signs of the straight between them, shape (n, 5)."""
    turns = motions.both_ways
    signs = (1.0, -1.0) if motions.astern else (1.0,)
    return np.array([(*a, *b, sign) for a in turns for b in turns for sign in signs])


def best_words(
    motions: Motions, x: np.ndarray, y: np.ndarray, turn: np.ndarray, *, count: int = 1
) -> tuple[np.ndarray, np.ndarray]:
    """The fastest ways from pose to pose.

    Args:
        motions: What the robot can hold.
        x: Where to, ahead of the robot, shape (n,) [m].
        y: Where to, to its left, shape (n,) [m].
        turn: Change of heading, shape (n,) [rad].
        count: How many ways to find.

    Returns:
        Times, shape (count, n), rising along the first axis [s], and the words' rows in `all_words`, same shape.
    """
    words = all_words(motions)
    times = np.full((count, len(x)), np.inf)
    rows = np.zeros((count, len(x)), dtype=np.int32)
    for begin in range(0, len(x), _BATCH):
        some = slice(begin, begin + _BATCH)
        here, which = times[:, some], rows[:, some]
        pose = (x[some], y[some], turn[some])
        for row, word in enumerate(words):
            new = leg_time(motions, tuple(word), *pose)
            number = np.full(len(new), row, dtype=np.int32)
            for i in range(count):
                better = new < here[i]
                here[i], new = np.where(better, new, here[i]), np.where(better, here[i], new)
                which[i], number = np.where(better, number, which[i]), np.where(better, which[i], number)
    return times, rows
