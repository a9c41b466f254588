"""One controller in one row prepared for drawing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_benchmarks.drift.campaign import CampaignResult
from fulmar_benchmarks.drift.cells import spoken
from fulmar_benchmarks.results import PairResult
from fulmar_evaluation.report.style import colours


@dataclass(frozen=True)
class View:
    """What one controller did in one row."""

    row: str
    title: str  # of the row
    label: str  # of the controller
    colour: str
    outcome: PairResult

    @property
    def time_s(self) -> np.ndarray:
        """Ends of the control steps, shape (steps,) [s]."""
        steps = self.outcome.paths.shape[1]
        return float(self.outcome.about["control_dt"]) * np.arange(1, steps + 1)


def views(result: CampaignResult, kind: str) -> dict[str, list[View]]:
    """By row, every controller that has a result in it."""
    document: dict[str, Any] = result.document
    colour = dict(zip(document["controllers"], colours(document["controllers"]), strict=True))
    found = {
        name: [
            View(
                name, row["title"], spoken(controller), colour[controller], result.outcomes[name, controller]
            )
            for controller in document["controllers"]
            if (name, controller) in result.outcomes
        ]
        for name, row in document["rows"].items()
        if row["kind"] == kind
    }
    return {name: some for name, some in found.items() if some}
