"""Sets of conditions, 0 the easiest and 1 the hardest on each axis: a box, and level sets of a monotone score."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol, Self

import numpy as np

CHUNK = 1 << 14  # points that are drawn at once
SWEEPS = 60  # over all axes of a walk, after which it has forgotten where it began
OUTER = 0.1  # share of the volume that counts as the edge [-]


class ConditionSet(Protocol):
    """A set that shrinks toward the easiest conditions."""

    def contains(self, shares: np.ndarray) -> np.ndarray:
        """Whether points lie in it, shape (n, k) to (n,)."""

    def sample(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """Points drawn uniformly, shape (count, k)."""

    def shrunk(self, volume: float, rng: np.random.Generator) -> Self:
        """The part of it that is easier, with so large a share of its volume."""

    def depth(self, shares: np.ndarray) -> np.ndarray:
        """How hard points are, shape (n, k) to (n,): that of the end is the largest inside."""

    def to_depth(self, depth: float) -> Self:
        """The part of it up to a depth."""


def outer_sample(of: ConditionSet, rng: np.random.Generator, count: int) -> np.ndarray:
    """Points of the outer tenth of a set by volume, shape (count, k)."""
    inner, found = of.shrunk(1.0 - OUTER, rng), np.empty((0, 0))
    while len(found) < count:
        points = of.sample(rng, 4 * count)
        points = points[~inner.contains(points)]
        found = points if not len(found) else np.concatenate((found, points))
    return found[:count]


@dataclass(frozen=True)
class Box:
    """All conditions up to a value on each axis."""

    high: np.ndarray  # (k,)

    def contains(self, shares: np.ndarray) -> np.ndarray:
        """See `ConditionSet.contains`."""
        return np.asarray(np.all(shares <= self.high, axis=-1))

    def sample(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """See `ConditionSet.sample`."""
        return self.high * rng.random((count, len(self.high)))

    def shrunk(self, volume: float, rng: np.random.Generator) -> Self:
        """See `ConditionSet.shrunk`; every axis by the same factor."""
        return replace(self, high=self.high * volume ** (1.0 / len(self.high)))

    def depth(self, shares: np.ndarray) -> np.ndarray:
        """See `ConditionSet.depth`: the factor by which the box would have to shrink to end there."""
        return np.asarray(np.max(shares / self.high, axis=-1))

    def to_depth(self, depth: float) -> Self:
        """See `ConditionSet.to_depth`."""
        return replace(self, high=self.high * depth)

    @property
    def volume(self) -> float:
        """Share of the cube [-]."""
        return float(np.prod(self.high))


@dataclass(frozen=True)
class ScoreSet:
    """All conditions with a score up to a threshold: weights >= 0 make it monotone on every axis."""

    linear: np.ndarray  # (k,) >= 0
    quadratic: np.ndarray  # (k, k) upper triangle, >= 0
    threshold: float

    def score(self, shares: np.ndarray) -> np.ndarray:
        """Score of points, shape (n, k) to (n,) [-]."""
        return np.asarray(shares @ self.linear + np.sum((shares @ self.quadratic) * shares, axis=-1))

    def contains(self, shares: np.ndarray) -> np.ndarray:
        """See `ConditionSet.contains`."""
        return np.asarray(self.score(shares) <= self.threshold)

    def bounding_high(self) -> np.ndarray:
        """The far corner of its bounding box: by monotony where each axis alone meets the threshold, shape (k,)."""
        return np.minimum(1.0, _root(np.diag(self.quadratic), self.linear, self.threshold))

    def sample(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """See `ConditionSet.sample`: by rejection from the bounding box, or by walks where that accepts too few."""
        points = Box(self.bounding_high()).sample(rng, CHUNK)
        inside = points[self.contains(points)]
        return inside[:count] if len(inside) >= count else self._walk(rng, count)

    def _walk(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """Points by Gibbs sampling, each from a walk of its own, shape (count, k).

        The score is monotone, so that along one axis the set is an interval from 0 on, whose end is a root.
        """
        coupling = self.quadratic + self.quadratic.T
        squares = np.diag(self.quadratic).copy()
        np.fill_diagonal(coupling, 0.0)
        points = rng.random((self.linear.size, count))  # one axis after the other in memory
        along, across = self.linear @ points, np.sum((self.quadratic @ points) * points, axis=0)
        points *= np.minimum(1.0, _root(across, along, self.threshold)) * rng.random(count)
        for _ in range(SWEEPS):
            score = self.score(points.T)
            for i, square in enumerate(squares):
                slope = self.linear[i] + coupling[i] @ points
                rest = score - (slope + square * points[i]) * points[i]
                end = np.minimum(1.0, _root(square, slope, np.maximum(self.threshold - rest, 0.0)))
                points[i] = end * rng.random(count)
                score = rest + (slope + square * points[i]) * points[i]
        return np.ascontiguousarray(points.T)

    def shrunk(self, volume: float, rng: np.random.Generator) -> Self:
        """See `ConditionSet.shrunk`."""
        scores = self.score(self.sample(rng, 4096))
        return replace(self, threshold=float(np.quantile(scores, volume)))

    def depth(self, shares: np.ndarray) -> np.ndarray:
        """See `ConditionSet.depth`."""
        return self.score(shares)

    def to_depth(self, depth: float) -> Self:
        """See `ConditionSet.to_depth`."""
        return replace(self, threshold=depth)

    def volume(self, rng: np.random.Generator, count: int = 16 * CHUNK) -> float:
        """Share of the cube, estimated from so many points of the bounding box [-]."""
        box = Box(self.bounding_high())
        return box.volume * float(np.mean(self.contains(box.sample(rng, count))))


def _root(a: Any, b: Any, c: Any) -> np.ndarray:
    """The root u >= 0 of a u² + b u = c for a, b, c >= 0, in the form that does not cancel where a is small."""
    divisor = b + np.sqrt(np.maximum(b * b + 4.0 * a * c, 0.0))
    return np.asarray(2.0 * c / np.maximum(divisor, 1e-12))
