"""From episodes to sets: a monotone quadratic score by logistic regression, and a box peeled from its predictions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit

from fulmar_evaluation.certify.sets import Box, ScoreSet

RIDGE = 1e-3  # of the weights, in mean log-likelihood: those that nothing decides stay small
PEEL = 0.03  # share of an axis that one step of the peeling takes away (Friedman and Fisher 1999, PRIM)
POINTS = 4096  # at which the box's success is predicted
HALVINGS = 12  # of the threshold's interval
SMALLEST = 0.02  # share of an axis that the box keeps at least


@dataclass(frozen=True)
class Fit:
    """Chance of failure expit(bias + score)."""

    linear: np.ndarray  # (k,)
    quadratic: np.ndarray  # (k, k) upper triangle
    bias: float

    def score(self, shares: np.ndarray) -> np.ndarray:
        """Monotone score, shape (n, k) to (n,) [-]."""
        return ScoreSet(self.linear, self.quadratic, 0.0).score(shares)

    def success(self, shares: np.ndarray) -> np.ndarray:
        """Predicted chance of success, shape (n, k) to (n,)."""
        return np.asarray(expit(-self.bias - self.score(shares)))

    def level(self, threshold: float) -> ScoreSet:
        """The set up to a threshold."""
        return ScoreSet(self.linear, self.quadratic, threshold)


def fit_score(shares: np.ndarray, succeeded: np.ndarray) -> Fit:
    """Fit the chance of failure by logistic regression on u_i and u_i u_j with weights >= 0.

    Args:
        shares: Conditions, shape (n, k), 0 to 1.
        succeeded: Shape (n,).
    """
    count = shares.shape[1]
    rows, columns = np.triu_indices(count)
    features = np.concatenate((shares, shares[:, rows] * shares[:, columns]), axis=1)
    failed = 1.0 - succeeded.astype(float)

    def loss(w: np.ndarray) -> tuple[float, np.ndarray]:
        logit = w[0] + features @ w[1:]
        error = expit(logit) - failed
        value = np.mean(np.logaddexp(0.0, logit) - failed * logit) + 0.5 * RIDGE * np.mean(w[1:] ** 2)
        slope = features.T @ error / len(failed) + RIDGE * w[1:] / len(w[1:])
        return float(value), np.concatenate(([error.mean()], slope))

    begin = np.full(1 + features.shape[1], 0.1)
    bounds = [(None, None)] + [(0.0, None)] * features.shape[1]
    weights = minimize(loss, begin, jac=True, bounds=bounds, method="L-BFGS-B", options={"maxiter": 300}).x
    quadratic = np.zeros((count, count))
    quadratic[rows, columns] = weights[1 + count :]
    return Fit(weights[1 : 1 + count], quadratic, float(weights[0]))


def first_level(fit: Fit, rng: np.random.Generator, wanted: float) -> ScoreSet:
    """The largest level set of a fit whose mean predicted success is as wanted, to shrink from.

    Args:
        fit: What predicts it.
        rng: Draws the points.
        wanted: Mean success [-].
    """
    low, high = 0.0, float(fit.score(np.ones((1, fit.linear.size)))[0])
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if float(np.mean(fit.success(fit.level(middle).sample(rng, POINTS)))) >= wanted:
            low = middle
        else:
            high = middle
    return fit.level(high)


def peel(fit: Fit, rng: np.random.Generator, wanted: float) -> Box:
    """Peel a box: take from the axis that gains the most success for the volume it costs, until it is as wanted."""
    count = fit.linear.size
    high, unit = np.ones(count), rng.random((POINTS, count))
    for _ in range(100 * count):
        here = fit.success(unit * high)
        if float(here.mean()) >= wanted:
            break
        kept = unit <= 1.0 - PEEL
        counts = np.maximum(kept.sum(axis=0), 1)
        gain = np.where(high > SMALLEST, here @ kept / counts - here.mean(), -np.inf)
        high[int(np.argmax(gain))] *= 1.0 - PEEL
    return Box(high)
