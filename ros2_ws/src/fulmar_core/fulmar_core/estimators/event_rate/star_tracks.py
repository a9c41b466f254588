"""Tracks of stars among the events of a window: noise is left out, and what remains is split into clusters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from fulmar_core.dynamics.sky.events import Events

SIDE = 3  # of the neighbourhood in which events are counted [px]
MOST_IN_PIXEL = 1000  # events of one pixel that count
LEAST = 4  # events in a neighbourhood, at least
FALSE_ALARMS = 1e-6  # expected share of neighbourhoods that noise alone fills
LEAST_EVENTS = 10  # of a track
HOT_SHARE = 0.8  # of a track's events in one pixel: then it is a hot pixel
MOST = 24_000  # events that are used: more are thinned, since they tell little new


@dataclass(frozen=True)
class Tracks:
    """Events that belong to stars."""

    places: np.ndarray  # column and row, shape (n, 2) [px]
    times_s: np.ndarray  # from the middle of the window, shape (n,) [s]
    group: np.ndarray  # number of the star and polarity: 2 · star + p, shape (n,)
    count: int  # of stars
    noise_hz: float  # of each pixel, as it was found [Hz]

    @property
    def star(self) -> np.ndarray:
        """Number of the star of each event, shape (n,)."""
        return np.asarray(self.group // 2)


def find_tracks(events: Events, begin_ns: int, end_ns: int) -> Tracks:
    """Find the tracks of stars.

    Args:
        events: Of the window, sorted.
        begin_ns: Of the window [ns].
        end_ns: Of the window [ns].
    """
    width, height = events.width, events.height
    pixel = events.y.astype(np.int64) * width + events.x
    counts = np.bincount(pixel, minlength=width * height).reshape(height, width)
    # Most pixels see noise alone: their rate follows from the share of pixels without an event.
    empty = float(np.mean(counts == 0))
    mean = -np.log(max(empty, 1e-6))
    dense = _around(np.minimum(counts, MOST_IN_PIXEL).astype(np.uint16)) >= _threshold(mean * SIDE * SIDE)
    label, found = ndimage.label(dense, structure=np.ones((3, 3)))
    label = label.astype(np.uint16) if found < 1 << 16 else label  # half as much memory to move
    of_event = _nearest_label(label)[events.y, events.x] if found else np.zeros(len(pixel), dtype=int)
    kept = np.flatnonzero(of_event)
    star = of_event[kept]
    kept, star = _without_hot_pixels(kept, star, pixel, found)
    if len(kept) > MOST:
        chosen = np.linspace(0, len(kept) - 1, MOST).astype(int)
        kept, star = kept[chosen], star[chosen]
    numbers, star = np.unique(star, return_inverse=True)
    times = (events.t[kept].astype(np.int64) - (begin_ns + end_ns) // 2) / 1e9
    places = np.stack((events.x[kept], events.y[kept]), axis=-1).astype(float)
    seconds = (end_ns - begin_ns) / 1e9
    group = 2 * star + events.p[kept]
    return Tracks(places, times, group, len(numbers), mean / seconds)


def _around(counts: np.ndarray) -> np.ndarray:
    """Sum over each neighbourhood of 3 × 3 pixels; sums of slices are ten times faster than a filter."""
    padded = np.pad(counts, 1)
    rows = padded[:-2] + padded[1:-1] + padded[2:]
    return np.asarray(rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:])


def _nearest_label(label: np.ndarray) -> np.ndarray:
    """Labels that reach one pixel farther."""
    padded = np.pad(label, 1)
    rows = np.maximum(np.maximum(padded[:-2], padded[1:-1]), padded[2:])
    return np.asarray(np.maximum(np.maximum(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:]))


def _threshold(mean: float) -> int:
    """Events of a neighbourhood that noise of such a mean reaches with `FALSE_ALARMS`."""
    count, term, tail = 0, np.exp(-mean), 1.0 - np.exp(-mean)
    while tail > FALSE_ALARMS:
        count += 1
        term *= mean / count
        tail -= term
    return max(LEAST, count + 1)


def _without_hot_pixels(
    kept: np.ndarray, star: np.ndarray, pixel: np.ndarray, found: int
) -> tuple[np.ndarray, np.ndarray]:
    """Leave out clusters of too few events, and those of which nearly all come from one pixel."""
    if not len(kept):
        return kept, star
    size = np.bincount(star, minlength=found + 1)
    pair, times = np.unique(star.astype(np.int64) * (int(pixel.max()) + 1) + pixel[kept], return_counts=True)
    most = np.zeros(found + 1, dtype=int)
    np.maximum.at(most, pair // (int(pixel.max()) + 1), times)
    good = (size >= LEAST_EVENTS) & (most < HOT_SHARE * size)
    right = good[star]
    return kept[right], star[right]
