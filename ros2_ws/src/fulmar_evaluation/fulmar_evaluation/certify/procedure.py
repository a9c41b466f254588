"""The procedure of a certification: explore, fit, shrink on fresh episodes, and test once on others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from fulmar_evaluation.certify.confidence import alpha_of, lower_bound
from fulmar_evaluation.certify.fit import Fit, first_level, fit_score, peel
from fulmar_evaluation.certify.sets import Box, ConditionSet, ScoreSet, outer_sample

Run = Callable[[np.ndarray], np.ndarray]  # conditions, shape (n, k), to which succeeded, shape (n,)
C = TypeVar("C", bound=ConditionSet)
EASIEST = (1.0, 0.30, 0.08, 0.03)  # share of the cube that each round of the exploration draws from
LEAST, LEAST_EDGE = 0.95, 0.90  # of the bound inside, and of the mean of the outer tenth
ALPHA = 0.05  # chance that any bound of a set is too high
# Shrinking ends above the bound that is asked for: the one test, and an independent simulator, would else miss it.
MARGIN = 0.025
# Mean success that the fit predicts where shrinking begins: fits are pessimistic where few episodes fail.
BEGIN = 0.88
STEP = 0.8  # volume that is left after shrinking by one step [-]
SMALL_STEP = 0.2, 0.9  # volume that one shrinking leaves at least and at most [-]
GOOD = 0.985  # success of the part that a shrinking leaves [-]
SHRINKINGS, TESTS = 24, 4


@dataclass(frozen=True)
class Sizes:
    """Numbers of episodes."""

    round: int = 2048  # of each round of the exploration
    shrink: int = 2000
    test: int = 2000
    edge: int = 1000
    mujoco: int = 500

    @classmethod
    def of(cls, test: int, *, mujoco: int) -> Sizes:
        """All numbers in proportion to that of a test."""
        return cls(round(1.024 * test), test, test, max(1, test // 2), mujoco)

    @property
    def expected(self) -> int:
        """About how many run in the batch, for a progress bar."""
        return len(EASIEST) * self.round + 2 * (3 * self.shrink + self.test + self.edge)


@dataclass(frozen=True)
class Tested(Generic[C]):
    """A set that met every bound on fresh episodes."""

    set: C
    episodes: int
    successes: int
    lower_bound: float
    edge_episodes: int
    edge_successes: int
    tests: int  # how many were made, of which each paid its share


@dataclass(frozen=True)
class Result:
    """What a certification found; a set is None where none met its bounds."""

    fit: Fit
    score: Tested[ScoreSet] | None
    box: Tested[Box] | None
    shares: np.ndarray  # (n, k) of the exploration
    succeeded: np.ndarray  # (n,)
    reason: str  # why there is no set; empty where there is one


def certify(run: Run, axes: int, sizes: Sizes, seed: int) -> Result:
    """Find the conditions under which `run` succeeds, and prove it.

    Args:
        run: Runs episodes; never the same one twice.
        axes: Number of axes.
        sizes: Numbers of episodes.
        seed: Of the conditions that are drawn.
    """
    rng = np.random.default_rng([seed, axes])
    fit, shares, succeeded = explore(run, axes, sizes, rng)
    best = float(succeeded[-sizes.round :].mean())
    if not succeeded.any():
        return Result(fit, None, None, shares, succeeded, f"none of {len(shares)} episodes succeeded")
    reason, box = "", None
    score = tested(first_level(fit, rng, BEGIN), run, sizes, rng)
    if score is None:
        reason = (
            f"no part of the conditions has a lower bound of {LEAST:g}; the easiest "
            f"{EASIEST[-1]:.0%} of them succeed in {best:.1%} of episodes"
        )
    else:
        box = tested(peel(fit, rng, BEGIN), run, sizes, rng)
    return Result(fit, score, box, shares, succeeded, reason)


def explore(
    run: Run, axes: int, sizes: Sizes, rng: np.random.Generator
) -> tuple[Fit, np.ndarray, np.ndarray]:
    """Episodes all over the cube first, then where the last fit calls them ever easier."""
    shares, succeeded, fit = np.empty((0, axes)), np.empty(0, dtype=bool), None
    for part in EASIEST:
        points = rng.random((round(sizes.round / part), axes))
        if fit is not None:
            points = points[np.argsort(fit.score(points), kind="stable")[: sizes.round]]
        shares = np.concatenate((shares, points))
        succeeded = np.concatenate((succeeded, run(points)))
        fit = fit_score(shares, succeeded)
    assert fit is not None
    return fit, shares, succeeded


def shrunk_until_good(start: C, run: Run, sizes: Sizes, rng: np.random.Generator) -> C | None:
    """Shrink a set until fresh episodes in it, and in its outer tenth, succeed often enough; None: it never does."""
    found, outer = start, max(1, sizes.shrink // 10)
    for _ in range(SHRINKINGS):
        points = found.sample(rng, sizes.shrink)
        depth = found.depth(points)
        order = np.argsort(depth, kind="stable")
        succeeded = run(points)[order]
        bound = lower_bound(int(succeeded.sum()), len(succeeded), ALPHA)
        if bound >= _wanted(len(succeeded)) and succeeded[-outer:].mean() >= LEAST_EDGE + MARGIN:
            return found
        found = found.to_depth(float(depth[order][_level(succeeded) - 1]))
    return None


def _level(succeeded: np.ndarray) -> int:
    """How many of some episodes, the easiest first, the next smaller set shall hold.

    Those up to any depth are uniform in the part of the set up to it, so that one run says how good each part is.
    """
    count = np.arange(1, len(succeeded) + 1)
    mean = np.cumsum(succeeded) / count
    least, most = round(SMALL_STEP[0] * len(count)), round(SMALL_STEP[1] * len(count))
    good = np.flatnonzero(mean[least:most] >= GOOD)
    return int(least + (good[-1] if len(good) else 0)) or 1


def _wanted(episodes: int) -> float:
    """Bound that ends the shrinking: with few episodes less than the margin is left of it."""
    return min(LEAST + MARGIN, lower_bound(round(0.99 * episodes), episodes, ALPHA))


def tested(start: C, run: Run, sizes: Sizes, rng: np.random.Generator) -> Tested[C] | None:
    """Shrink a set, then test it on fresh episodes; each further test has half the chance of error of the last.

    Returns:
        The set with its bounds; None where it has none.
    """
    found: C | None = start
    for test in range(TESTS):
        assert found is not None
        found = shrunk_until_good(found, run, sizes, rng)
        if found is None:
            return None
        inside, edge = run(found.sample(rng, sizes.test)), run(outer_sample(found, rng, sizes.edge))
        bound = lower_bound(int(inside.sum()), len(inside), alpha_of(test, ALPHA))
        if bound >= LEAST and edge.mean() >= LEAST_EDGE:
            counts = len(inside), int(inside.sum()), bound, len(edge), int(edge.sum())
            return Tested(found, *counts, test + 1)
        found = found.shrunk(STEP, rng)
    return None
