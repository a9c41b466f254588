"""The pictures, each with words for somebody who has never seen one."""

from __future__ import annotations

from fulmar_benchmarks.drift.campaign import CampaignResult
from fulmar_benchmarks.drift.report.glance_plot import draw_glance
from fulmar_benchmarks.drift.report.path_plot import draw_paths
from fulmar_benchmarks.drift.report.start_plot import draw_starts
from fulmar_benchmarks.drift.report.time_plot import draw_row, draw_rows
from fulmar_benchmarks.drift.report.view import views
from fulmar_evaluation.report.plots import Picture


def pictures(findings: CampaignResult) -> dict[str, Picture]:
    """By the names of their files; call inside `house_style`."""
    drawn: dict[str, Picture] = {}
    glance = draw_glance(findings.document)
    if glance is not None:
        drawn["at_a_glance"] = Picture(
            "At a glance",
            _words("""
            Share of the time nearer to the goal than 5, 2 and 1 cm, and within 5° of its heading; the further right,
            the better. A filled dot is the mean of our trajectories, the thin line spans nine in ten of them. The
            ring is what DRIFT reports for its policy (beside ours) and its LQR (beside all others), the upright
            stroke what this project asks of itself."""),
            glance,
        )
    poses, paths = views(findings, "pose"), views(findings, "path")
    if poses:
        first = next(iter(poses.values()))
        drawn["over_time"] = Picture(
            f"All trajectories over time: {first[0].title.lower()}",
            _words("""
            The line is the median of all trajectories, the dark band holds the middle half of them and the pale band
            nine in ten. Errors are on logarithmic scales; dashed are the 5 cm and 5° of PT5 and OT5. A line that
            falls early, stays low and has a narrow band is good."""),
            draw_row(first),
        )
    if len(poses) > 1:
        drawn["conditions_over_time"] = Picture(
            "The same under every disturbance",
            "Median and the band of nine in ten. What a disturbance costs shows against the first line.",
            draw_rows(poses),
        )
    if poses:
        hard = [row for row in ("force_torque", "force_4", "torque") if row in poses]
        rows = list(dict.fromkeys([next(iter(poses)), *hard[:1]]))
        drawn["starts"] = Picture(
            "The same starts with every controller",
            _words("""
            Two starts, and below each the distance and the heading error. The goal is in the middle. Circles show the
            platform every 8 s at first, the stroke inside where it is heading."""),
            draw_starts(poses, rows),
        )
    if paths:
        drawn["paths"] = Picture(
            "Paths followed at 0.2 m/s",
            _words("""
            Dashed is the path, the dot where the first run begins, at rest. Below: length of the wanted minus the
            true velocity, and the distance from the path. The shaded first seconds are the run-up, in which nobody
            can have the wanted speed yet; figures "under way" leave it out. At the corners of the square the wanted
            velocity turns by 90° at once."""),
            draw_paths(paths),
        )
    return drawn


def _words(text: str) -> str:
    return " ".join(text.split())
