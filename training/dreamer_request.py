"""What the process that learns is asked for."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass

from training.learner_curve import Budget


@dataclass(frozen=True)
class Request:
    """One training."""

    robot: str
    task: str
    seed: int
    settings: str  # file of training settings
    out: str  # run folder
    time_limit_s: float | None = None  # wall-clock [s]; the first limit reached ends the run
    updates: int | None = None  # gradient steps
    resume: bool = False
    calibration: str = ""
    budget: Budget | None = None  # of a comparison of learners, instead of the limits

    def as_json(self) -> str:
        """One line that `from_json` reads."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Request:
        """Read what `as_json` wrote."""
        values = json.loads(text)
        budget = values.pop("budget")
        return cls(**values, budget=Budget(**budget) if budget else None)
