"""What a machine can do at best in the world that it has: the yardstick beside a controller's figures.

- `can_hold` and `can_hold_episodes` decide whether a pose can be held with the thrusters that are left.
- `approach_bound` bounds the share of time that a start from rest leaves near the goal.
"""

from __future__ import annotations

from fulmar_core.feasibility.approach import approach_bound
from fulmar_core.feasibility.episodes import can_hold_episodes
from fulmar_core.holding import can_hold, hold_margin

__all__ = ["approach_bound", "can_hold", "can_hold_episodes", "hold_margin"]
