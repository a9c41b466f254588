"""The most targets that physics allows a body in space to pass, kept by robot and task."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from fulmar_benchmarks.rans3d.unit import SpaceTrial
from fulmar_benchmarks.shape import Cell, Figures, Progress
from fulmar_evaluation.bounds.space_tour import most_targets

BOUNDED = 64  # episodes, from the first on: each takes a tenth of a second


@dataclass(frozen=True, kw_only=True)
class BoundCell(Cell):
    """Bound on the first `BOUNDED` episodes of a trial."""

    modules = ("fulmar_benchmarks.rans3d.unit",)
    trial: SpaceTrial

    @property
    def numbers(self) -> np.ndarray:
        """Of the episodes."""
        return np.arange(min(self.trial.episodes, BOUNDED))

    def parts(self) -> dict[str, Any]:
        """The same for every controller."""
        plan = asdict(replace(self.trial.plan, policy="", controller=""))
        return {"plan": plan, "farthest_m": self.trial.farthest_m, "episodes": len(self.numbers)}

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """Whole targets of each episode."""
        return {"goals": most_targets(self.trial.robot, self.trial.task, self.trial.drawn(self.numbers))}


def bound_cell(trial: SpaceTrial) -> BoundCell:
    """A cell with its name."""
    plan = trial.plan
    cost = 5e4 * min(trial.episodes, BOUNDED)
    return BoundCell(name=f"bound_{plan.robot}_{plan.task}", cost=cost, trial=trial)
