"""One run made ready for drawing: record, result, summary, name and colour."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_bags.run_record import RunRecord
from fulmar_evaluation.report.style import colours
from fulmar_evaluation.run_evaluation import RunResult, evaluate_run
from fulmar_evaluation.run_summary import latencies_ms, summarise

SPOKEN = {
    "lqr": "LQR",
    "mpc": "MPC",
    "lqr_drift": "DRIFT's LQR",
    "policy": "policy",
    "classical": "classical law",
    "excite": "excitation",
    "external": "external controller",
}


@dataclass(frozen=True)
class View:
    """Everything that a picture or a sentence about one run needs."""

    label: str
    colour: str
    record: RunRecord
    result: RunResult | None  # None: the record is too short to judge
    summary: dict[str, Any]
    latencies_ms: np.ndarray

    @property
    def binary(self) -> bool:
        """Whether the actuators are valves, open or closed."""
        return self.result is None or self.result.robot.actuators.binary


def views(records: Sequence[RunRecord]) -> list[View]:
    """Prepare runs for one report.

    Args:
        records: At least one.

    Raises:
        FulmarError: A record names no task or goal.
    """
    controllers = [str(record.info.get("controller", "unknown")) for record in records]
    labels = [SPOKEN.get(name, name) for name in controllers]
    if len(set(labels)) < len(labels):  # runs of one controller are told apart by their bags
        labels = [f"{label} ({record.path.name})" for label, record in zip(labels, records, strict=True)]
    return [
        View(label, colour, record, evaluate_run(record), summarise(record), latencies_ms(record))
        for label, colour, record in zip(labels, colours(controllers), records, strict=True)
    ]


def evaluated(runs: Sequence[View]) -> list[tuple[View, RunResult]]:
    """Those runs that have a result, with it."""
    return [(run, run.result) for run in runs if run.result is not None]
