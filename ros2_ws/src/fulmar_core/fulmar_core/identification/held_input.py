"""What actuators did during each integration step, as a smooth function of their delay.

A simulator that switches at its ticks knows delays in whole ticks only, and a fit needs slopes. The mean over a step of
an input that is late by any amount has them: it is a difference of the input's integral at two times.
"""

from __future__ import annotations

import numpy as np


def mean_over_steps(
    event_s: np.ndarray, change: np.ndarray, begin_s: np.ndarray, *, steps: int, dt: float
) -> np.ndarray:
    """Means of a piecewise constant input that is zero before its first event.

    Args:
        event_s: When it changes, in any order, shape (k,) [s].
        change: By how much, shape (k, c).
        begin_s: Beginnings of windows, shape (w,) [s].
        steps: Steps in each window.
        dt: Length of a step [s].

    Returns:
        Shape (steps, c, w).
    """
    order = np.argsort(event_s, kind="stable")
    knots, rates = event_s[order], np.cumsum(change[order], axis=0)
    edges = begin_s[None, :] + dt * np.arange(steps + 1)[:, None]  # (steps + 1, w)
    end = max(float(edges.max()), float(knots[-1])) + 1.0
    knots = np.append(knots, end)
    integral = np.concatenate((np.zeros((1, rates.shape[1])), np.cumsum(rates * np.diff(knots)[:, None], axis=0)))
    at_edges = np.stack(
        [np.interp(edges, knots, integral[:, c], left=0.0) for c in range(integral.shape[1])], axis=1
    )
    return np.diff(at_edges, axis=0) / dt
