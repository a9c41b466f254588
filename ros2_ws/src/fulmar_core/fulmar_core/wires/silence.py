"""How long commands may fail to come until actuators go to their safe state."""

from __future__ import annotations

SHORTEST_S = 0.2
LONGEST_S = 0.5


def default_timeout(control_dt: float) -> float:
    """Silence that makes actuators safe: two command periods, at least 0.2 s and at most 0.5 s [s]."""
    return min(max(SHORTEST_S, 2.0 * control_dt), LONGEST_S)
