"""Report of the benchmark: its sections, tables and plots."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path

from matplotlib.figure import Figure

from fulmar_benchmarks.cells import as_html
from fulmar_benchmarks.drift.cells import (
    PATH_HEADS,
    Line,
    display_name,
    missing,
    path_lines,
    pose_heads,
    pose_lines,
    unmet,
)
from fulmar_benchmarks.drift.document import Key
from fulmar_benchmarks.drift.report.path_plots import draw_paths, draw_starts
from fulmar_benchmarks.drift.report.plots import draw_glance, draw_row, draw_rows, views
from fulmar_benchmarks.drift.tables import conclusion, notes
from fulmar_benchmarks.drift.targets import BANDS
from fulmar_benchmarks.results import CampaignResult
from fulmar_evaluation.report.page import Part, Plot, cells, faint, headline, origin, table
from fulmar_evaluation.report.style import house_style
from fulmar_evaluation.report.writer import write_benchmark

_STYLE = (
    "".join(f".{band.name} {{ background: {band.paper} }} " for band in BANDS)
    + """
th, td { padding: .25rem .4rem; font-size: .87rem } th { white-space: normal; vertical-align: bottom }
td:first-child { white-space: nowrap } td:nth-child(2) { text-align: left; white-space: nowrap }
tr.published td { color: var(--faint) } tr.bound td { font-style: italic }
tr.first td { border-top: 2px solid var(--rule) }
.key span { padding: .1rem .5rem; margin-right: .3rem; white-space: nowrap }
"""
)


def write_report(result: CampaignResult[Key], out: Path) -> Path:
    """Write the page and its plots into a folder; returns the page."""
    with house_style():
        return write_benchmark(out, "Fulmar beside DRIFT", _parts(result), style=_STYLE)


def _parts(result: CampaignResult[Key]) -> list[Part]:
    document = result.document
    who = " and ".join(display_name(name) for name in document["controllers"])
    poses, paths = pose_lines(document), path_lines(document)
    parts: list[Part] = [
        *faint(f"{who} on the floating platform, thesis chapter 3, Tables 3.5 and 3.6"),
        headline(conclusion(document)),
        *faint(*missing(document), *notes(document)),
    ]
    if poses:
        parts += ["<h2>Go to pose under disturbances</h2>", _table(pose_heads(), poses), _key()]
    if paths:
        parts += ["<h2>Paths followed at 0.2 m/s</h2>", _table(PATH_HEADS, paths)]
    if unmet(document):
        parts += ["<h2>Required and not met</h2>", *faint(*unmet(document))]
    return [*parts, "<h2>Plots</h2>", *_plots(result), *origin(document, "drift.json")]


def _plots(result: CampaignResult[Key]) -> list[Plot]:
    drawn: list[Plot] = []

    def add(name: str, title: str, caption: str, figure: Figure) -> None:
        drawn.append(Plot(title, caption, figure, name))

    glance = draw_glance(result.document)
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
    poses, paths = views(result, "pose"), views(result, "path")
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


def _table(heads: Sequence[str], lines: Sequence[Line]) -> str:
    rows = (
        f'<tr class="{line.kind}{" first" if line.title else ""}"><td>{escape(line.title)}</td>'
        f"<td>{escape(line.controller)}</td>"
        f"{''.join(as_html(cell.text, cell.tone, cell.band) for cell in line.cells)}</tr>"
        for line in lines
    )
    return table([cells(["", "", *heads], "th")], rows)


def _key() -> str:
    low, parts = 0.0, []
    for band in BANDS:
        parts.append(f'<span class="{band.name}">{low:.0f}–{band.most:.0f} %</span>')
        low = band.most
    return f'<p class="faint key">Behind the same controller\'s ideal row by {"".join(parts)}</p>'
