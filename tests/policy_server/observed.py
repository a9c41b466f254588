"""Inputs for networks that act on an observation alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks.goal import Goal


def inputs_seeing(observations: Any) -> Inputs:
    """Inputs of which only the observation is known, shape (n, k), or (k,) for one robot."""
    rows = np.atleast_2d(np.asarray(observations, dtype=float))
    count = len(rows)
    unknown = np.full(count, np.nan)
    goal = Goal(np.full((count, 1, 3), np.nan), unknown, np.zeros((count, 0, 3)))
    state = PlanarState(*(unknown for _ in PlanarState.COLUMNS))
    return Inputs(state, goal, rows, np.zeros((count, 0)), None, 0, np.nan)
