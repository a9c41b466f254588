"""The plots of the benchmark, with what they say."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from fulmar_benchmarks.drift.document import Key
from fulmar_benchmarks.drift.report.path_plots import draw_paths, draw_starts
from fulmar_benchmarks.drift.report.plots import draw_glance, draw_row, draw_rows, views
from fulmar_benchmarks.results import PairResult
from fulmar_evaluation.report.page import Plot


def plots(document: Mapping[str, Any], outcomes: dict[Key, PairResult]) -> list[Plot]:
    """What is drawn of a document and its outcomes."""
    drawn: list[Plot] = []

    def add(name: str, title: str, caption: str, figure: Figure) -> None:
        drawn.append(Plot(title, caption, figure, name))

    glance = draw_glance(document)
    if glance is not None:
        add(
            "at_a_glance",
            "At a glance",
            """
            Share of the time nearer to the goal than 5, 2 and 1 cm, and within 5° of its heading; the further right,
            the better. A filled dot is the mean of our trajectories, the thin line spans nine in ten of them. The
            ring is what DRIFT reports for its policy (beside ours) and its LQR (beside all others), the upright
            stroke what this project requires of itself.""",
            glance,
        )
    poses, paths = (views(document, outcomes, kind) for kind in ("pose", "path"))
    if poses:
        first = next(iter(poses.values()))
        add(
            "over_time",
            f"All trajectories over time: {first[0].title.lower()}",
            """
            The line is the median of all trajectories, the dark band holds the middle half of them and the pale band
            nine in ten. Errors are on logarithmic scales; dashed are the 5 cm and 5° of PT5 and OT5. A line that
            falls early, stays low and has a narrow band is good.""",
            draw_row(first),
        )
    if len(poses) > 1:
        add(
            "conditions_over_time",
            "The same under every disturbance",
            "Median and the band of nine in ten. What a disturbance costs shows against the first line.",
            draw_rows(poses),
        )
    if poses:
        hard = [row for row in ("force_torque", "force_4", "torque") if row in poses]
        rows = list(dict.fromkeys([next(iter(poses)), *hard[:1]]))
        add(
            "starts",
            "The same starts with every controller",
            """
            Two starts, and below each the distance and the heading error. The goal is in the middle. Circles show the
            platform every 8 s at first, the stroke inside where it is heading.""",
            draw_starts(poses, rows),
        )
    if paths:
        add(
            "paths",
            "Paths followed at 0.2 m/s",
            """
            Dashed is the path, the dot where the first run begins, at rest. Below: the length of the wanted minus the
            true velocity, and the distance from the path. The shaded first seconds are the run-up, in which nothing
            can have the wanted speed yet; figures "under way" leave it out. At the corners of the square the wanted
            velocity turns by 90° at once.""",
            draw_paths(paths),
        )
    return drawn
