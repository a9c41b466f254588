"""What this project asks of its own controllers in DRIFT's benchmark, and whether a measurement meets it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fulmar_benchmarks.drift.published import BETTER
from fulmar_benchmarks.required import Verdict

# Percent of the time, at least; AAS and velocity errors [m/s], at most. Of unrounded means.
ASKED: dict[str, dict[str, dict[str, float]]] = {
    "policy": {
        "ideal": {"PT5": 80, "PT2": 78, "PT1": 62, "OT5": 96, "OT2": 92, "OT1": 80, "AAS": 0.09},
        "velocity_noise_4": {"PT5": 79, "PT2": 65, "OT5": 96},
        "torque": {"PT5": 80, "PT1": 65, "OT5": 96},
        "force_2": {"PT5": 79, "PT2": 77},
        "force_4": {"PT5": 75, "PT2": 68, "PT1": 45},
        "force_torque": {"PT5": 79, "OT5": 96},
        "one_lost": {"PT5": 78, "OT5": 94},
        "two_lost": {"PT5": 50, "OT5": 70},
        "circle": {"velocity_error": 0.010},
        "infinite": {"velocity_error": 0.010},
        "square": {"velocity_error": 0.035},
    },
    "lqr": {
        "ideal": {"PT5": 78, "PT2": 72, "PT1": 50, "OT5": 92, "OT2": 85, "OT1": 70, "AAS": 0.08},
        "velocity_noise_4": {"PT5": 74, "PT2": 50, "OT5": 90},
        "torque": {"PT5": 76, "PT1": 45, "OT5": 90},
        "force_2": {"PT5": 77, "PT2": 68},
        "force_4": {"PT5": 74, "PT2": 60, "PT1": 35},
        "force_torque": {"PT5": 76, "OT5": 90},
        "one_lost": {"PT5": 72, "OT5": 88},
        "two_lost": {"PT5": 42, "OT5": 62},
        "circle": {"velocity_error": 0.010},
        "infinite": {"velocity_error": 0.010},
        "square": {"velocity_error": 0.035},
    },
}


@dataclass(frozen=True)
class Requirement:
    """One cell of the table of what is asked."""

    row: str
    controller: str
    figure: str
    limit: float

    @property
    def at_least(self) -> bool:
        """Whether more is better."""
        return BETTER.get(self.figure, "less") == "more"

    def verdict(self, measured: float | None) -> Verdict:
        """Compare with a measurement; None where there is none."""
        met = None
        if measured is not None:
            met = measured >= self.limit if self.at_least else measured <= self.limit
        return Verdict(self.figure, measured, self.limit, met)


def requirements(row: str, controller: str) -> list[Requirement]:
    """What is asked of a controller in a row; nothing of most."""
    limits: Mapping[str, float] = ASKED.get(controller, {}).get(row, {})
    return [Requirement(row, controller, figure, limit) for figure, limit in limits.items()]
