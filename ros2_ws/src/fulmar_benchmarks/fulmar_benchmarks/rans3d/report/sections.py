"""Report of the benchmark: its sections, tables and plots."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Any

from fulmar_benchmarks.cells import as_html, display_name, tone_of
from fulmar_benchmarks.rans3d.document import Key
from fulmar_benchmarks.rans3d.report.plots import draw_glance, draw_over_time, shown
from fulmar_benchmarks.rans3d.tables import (
    HEADS,
    cells_of,
    conclusion,
    missing,
    notes,
    other_lines,
    robots_of,
)
from fulmar_benchmarks.results import CampaignResult
from fulmar_evaluation.report.page import Part, Plot, cells, faint, headline, origin, table
from fulmar_evaluation.report.style import house_style
from fulmar_evaluation.report.writer import write_benchmark

_GLANCE = """
The further right, the better. A filled dot is the success in nominal episodes, a diamond the success under every
disturbance of `randomised`, among the episodes whose pose the linear programme can hold at all; the upright stroke is
what is required."""
_OVER_TIME = """
The median of all nominal episodes, with the band of nine in ten; the dashed line is the tolerance, or how many targets
make an episode a success. At track velocities the errors jump where a new target comes."""


def write_report(result: CampaignResult[Key], out: Path) -> Path:
    """Write the page and its plots into a folder; returns the page."""
    with house_style():
        return write_benchmark(out, "Fulmar at the 3-D tasks of RANS", _parts(result))


def _parts(result: CampaignResult[Key]) -> list[Part]:
    document = result.document
    parts: list[Part] = [headline(conclusion(document))]
    robots = robots_of(document)
    if robots:
        parts.append(Plot("At a glance", _GLANCE, draw_glance(document), "at_a_glance"))
    for robot, tasks in robots.items():
        parts += [f"<h2>{escape(display_name(robot))}</h2>", _table(document, robot, tasks)]
        if shown(robot, result.outcomes):
            over_time = draw_over_time(robot, result.outcomes)
            parts.append(Plot("Over time", _OVER_TIME, over_time, f"{robot}_over_time"))
    return [
        *parts,
        *faint(*missing(document), *notes(document)),
        "<h2>Beside the tasks</h2>",
        *(f"<p>{escape(line)}</p>" for line in other_lines(document)),
        "<h2>Required, and aimed at</h2>",
        _lines([*document["requirements"], *document["aims"]], required=len(document["requirements"])),
        *origin(document, "rans3d.json"),
    ]


def _table(document: dict[str, Any], robot: str, tasks: dict[str, Any]) -> str:
    body = [
        f"<tr>{cells([f'{display_name(task)}, {name}'])}"
        + "".join(as_html(each.text, each.tone) for each in cells_of(document, robot, task, name, cell))
        + "</tr>"
        for task, controllers in tasks.items()
        for name, cell in controllers.items()
    ]
    return table([cells(["", *HEADS], "th")], body)


def _lines(lines: list[dict[str, Any]], *, required: int) -> str:
    rows = []
    for place, line in enumerate(lines):
        sign = "≥" if line["better"] == "more" else "≤"
        measured = "–" if line["measured"] is None else f"{line['measured']:.3g}"
        kind = "required" if place < required else "aim"
        cell = as_html(measured, tone_of(line["met"]))
        limit = f"{sign} {line['limit']:g}"
        rows.append(f"<tr>{cells([line['name']])}{cell}{cells([limit, kind])}</tr>")
    return table([cells(["", "measured", "limit", ""], "th")], rows)
