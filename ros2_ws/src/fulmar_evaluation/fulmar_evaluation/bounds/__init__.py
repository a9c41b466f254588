"""What physics allows where waypoints are visited in order: the denominators of scores, computed per episode.

- `goals_reached` counts what a trajectory did.
- `bound_of` chooses the bound that fits a robot.
- `time_optimal_bound` is for machines whose thrust is the limit, such as the floating platform.
- `turn_limited_bound` is for machines that go where they point, such as boats and wheeled robots.
- `top_speed_bound` is for anything else whose speed is the limit.
"""

from __future__ import annotations

from fulmar_evaluation.bounds.by_kind import motions_of
from fulmar_evaluation.bounds.choice import NamedBound, bound_of
from fulmar_evaluation.bounds.motions import Motions
from fulmar_evaluation.bounds.time_optimal import time_optimal_bound
from fulmar_evaluation.bounds.top_speed import shortest_lengths, top_speed_bound
from fulmar_evaluation.bounds.turn_limited import turn_limited_bound
from fulmar_evaluation.bounds.visits import Bound, goals_reached

__all__ = [
    "Bound",
    "Motions",
    "NamedBound",
    "bound_of",
    "goals_reached",
    "motions_of",
    "shortest_lengths",
    "time_optimal_bound",
    "top_speed_bound",
    "turn_limited_bound",
]
