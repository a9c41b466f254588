"""What physics allows where waypoints are visited in order: the denominators of scores, computed per episode.

- `goals_reached` counts what a trajectory did.
- `top_speed_bound` is for machines whose speed is the limit, such as wheeled robots.
- `time_optimal_bound` is for machines whose thrust is, such as the floating platform.
"""

from __future__ import annotations

from fulmar_core.bounds.time_optimal import time_optimal_bound
from fulmar_core.bounds.top_speed import shortest_lengths, top_speed_bound
from fulmar_core.bounds.visits import Bound, goals_reached

__all__ = ["Bound", "goals_reached", "shortest_lengths", "time_optimal_bound", "top_speed_bound"]
