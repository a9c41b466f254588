"""Published values, our requirements, and drops against ideal: M. El-Hariry, chapter 3, Tables 3.5 and 3.6.

Simulated in MuJoCo. PT and OT are percent of the time below 5, 2 and 1 cm and degrees, means over 256 trajectories of
250 steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fulmar_benchmarks.shape import Check

FIGURES = ("PT5", "PT2", "PT1", "OT5", "OT2", "OT1", "ALV", "AAV", "AAS")
DIGITS = {name: 0 if name[1] == "T" else 2 for name in FIGURES}  # as printed there
BETTER = {name: "more" if name[1] == "T" else "less" for name in FIGURES}

# Which of its two controllers stands beside which of ours.
BESIDE = {"policy": "RL"}  # all others are compared with its LQR
_RL = {
    "ideal": (64, 34, 6, 94, 89, 73, 0.08, 0.12, 0.29),
    "velocity_noise_2": (64, 30, 7, 94, 90, 72, 0.08, 0.12, 0.31),
    "velocity_noise_4": (61, 21, 6, 94, 89, 66, 0.09, 0.13, 0.31),
    "torque": (63, 24, 2, 94, 86, 61, 0.08, 0.12, 0.35),
    "force_2": (63, 29, 7, 94, 90, 74, 0.09, 0.12, 0.30),
    "force_4": (52, 19, 5, 94, 89, 72, 0.09, 0.12, 0.31),
    "force_torque": (62, 24, 5, 94, 86, 61, 0.08, 0.12, 0.35),
    "one_lost": (32, 15, 6, 70, 55, 36, 0.10, 0.12, 0.28),
    "two_lost": (15, 6, 2, 45, 31, 20, 0.16, 0.15, 0.25),
}
_LQR = {
    "ideal": (73, 41, 17, 27, 11, 5, 0.07, 0.16, 0.10),
    "velocity_noise_2": (53, 21, 6, 4, 1, 0, 0.09, 0.49, 0.23),
    "velocity_noise_4": (14, 3, 0, 2, 1, 0, 0.15, 0.56, 0.29),
    "torque": (57, 20, 6, 3, 1, 0, 0.07, 0.43, 0.35),
    "force_2": (66, 17, 4, 28, 12, 6, 0.07, 0.15, 0.12),
    "force_4": (23, 0, 0, 30, 13, 6, 0.08, 0.16, 0.15),
    "force_torque": (13, 2, 0, 3, 1, 0, 0.07, 0.44, 0.32),
    "one_lost": (40, 17, 5, 20, 8, 4, 0.10, 0.21, 0.16),
    "two_lost": (12, 4, 1, 11, 4, 2, 0.14, 0.28, 0.22),
}
# Table 3.6: velocity error, mean and standard deviation over the run, simulated [m/s]. Its policy alone was tried.
TRACKING = {"circle": (0.01, 0.01), "infinite": (0.01, 0.01), "square": (0.05, 0.08)}


def published(row: str, controller: str) -> tuple[str, dict[str, float]]:
    """What stands beside one of our controllers in a row of Table 3.5.

    Returns:
        RL or LQR, and its figures by the names of `FIGURES`.
    """
    kind = BESIDE.get(controller, "LQR")
    return kind, dict(zip(FIGURES, (_RL if kind == "RL" else _LQR)[row], strict=True))


# Percent of the time, at least; AAS and velocity errors [m/s], at most. Of unrounded means.
REQUIRED: dict[str, dict[str, dict[str, float]]] = {
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
    """One cell of the table of requirements."""

    row: str
    controller: str
    figure: str
    limit: float

    @property
    def at_least(self) -> bool:
        """Whether more is better."""
        return BETTER.get(self.figure, "less") == "more"

    def check(self, measured: float | None) -> Check:
        """Compare with a measurement; None where there is none."""
        return (Check.least if self.at_least else Check.most)(self.figure, measured, self.limit)


def requirements(row: str, controller: str) -> list[Requirement]:
    """Requirements for a controller in a row; nothing of most."""
    limits: Mapping[str, float] = REQUIRED.get(controller, {}).get(row, {})
    return [Requirement(row, controller, figure, limit) for figure, limit in limits.items()]


@dataclass(frozen=True)
class Band:
    """One colour of the table."""

    name: str
    most: float  # drop at its upper end [%]
    paper: str  # background on a page, under dark and light type alike
    terminal: str  # style of rich


BANDS = (
    Band("blue", 20.0, "#3b82f633", "on #1d3f72"),
    Band("green", 40.0, "#22c55e33", "on #14532d"),
    Band("yellow", 60.0, "#eab30840", "on #6b5206"),
    Band("red", 80.0, "#ef444440", "on #7f1d1d"),
    Band("purple", 100.0, "#a855f755", "on #581c87"),
)


def drop_percent(figure: str, value: float, ideal: float) -> float | None:
    """How much worse a figure is than under ideal conditions.

    Args:
        figure: Its name, which says whether more or less is better.
        value: Under the condition.
        ideal: Under ideal ones.

    Returns:
        Share of the ideal value that is lost, or, where less is better, by which it is exceeded; from 0 to 100 [%].
        None where the ideal value is 0, of which nothing can be a share.
    """
    if ideal == 0.0:
        return None
    worse = ideal - value if BETTER[figure] == "more" else value - ideal
    return min(max(100.0 * worse / ideal, 0.0), 100.0)


def band_of(drop: float) -> Band:
    """The colour of a drop; on a border the better one."""
    return next(band for band in BANDS if drop <= band.most)
