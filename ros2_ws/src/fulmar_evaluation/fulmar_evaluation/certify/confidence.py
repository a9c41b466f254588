"""Lower bounds on a chance of success from episodes that succeeded."""

from __future__ import annotations

from scipy.stats import beta


def lower_bound(successes: int, episodes: int, alpha: float) -> float:
    """One-sided lower bound of Clopper and Pearson (Biometrika 26, 1934) on a chance of success.

    Args:
        successes: Episodes that succeeded.
        episodes: All of them, >= 1.
        alpha: Chance that the bound is too high, 0 to 1.
    """
    return 0.0 if successes == 0 else float(beta.ppf(alpha, successes, episodes - successes + 1))


def alpha_of(test: int, total: float) -> float:
    """Share of the chance of error that a test spends, the first one half, each further one half of that before.

    Together they spend no more than `total`, however many follow.

    Args:
        test: 0 for the first.
        total: Chance that any bound is too high.
    """
    return float(total * 0.5 ** (test + 1))
