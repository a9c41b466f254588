"""One controller in one row made ready for drawing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_benchmarks.drift.campaign import CampaignResult
from fulmar_benchmarks.drift.cells import spoken
from fulmar_benchmarks.results import PairResult
from fulmar_evaluation.report.style import colours

WIDTH = 9.2  # of a picture [inch]


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


def views(findings: CampaignResult, kind: str) -> dict[str, list[View]]:
    """By row, every controller that was judged in it.

    Args:
        findings: Of the benchmark.
        kind: pose or path.
    """
    document: dict[str, Any] = findings.document
    colour = dict(zip(document["controllers"], colours(document["controllers"]), strict=True))
    found = {
        name: [
            View(
                name,
                row["title"],
                spoken(controller),
                colour[controller],
                findings.outcomes[name, controller],
            )
            for controller in document["controllers"]
            if (name, controller) in findings.outcomes
        ]
        for name, row in document["rows"].items()
        if row["kind"] == kind
    }
    return {name: some for name, some in found.items() if some}
