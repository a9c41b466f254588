"""How far a figure falls behind the same controller's under ideal conditions, in the five colours of Table 3.5."""

from __future__ import annotations

from dataclasses import dataclass

from fulmar_benchmarks.drift.published import BETTER


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
        figure: Its name, which tells whether more or less is better.
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
