"""The report as one self-contained HTML page."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

from fulmar_benchmarks.cells import BAD, GOOD
from fulmar_benchmarks.drift.cells import (
    PATH_HEADS,
    Cell,
    Line,
    missing,
    path_lines,
    pose_heads,
    pose_lines,
    spoken,
    unmet,
)
from fulmar_benchmarks.drift.tables import notes, verdict
from fulmar_benchmarks.drift.targets import BANDS
from fulmar_benchmarks.roboran.report.layout import origin, shown, whole_page
from fulmar_evaluation.report.plots import Picture

_MARKS = {GOOD: " ✓", BAD: " ✗", "": ""}
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


def page(document: dict[str, Any], drawn: Sequence[Picture]) -> str:
    """Lay out the page.

    Args:
        document: Of the benchmark.
        drawn: The pictures in their order.

    Returns:
        HTML that needs nothing from anywhere else.
    """
    title = "Fulmar beside DRIFT"
    who = " and ".join(spoken(name) for name in document["controllers"])
    poses, paths = pose_lines(document), path_lines(document)
    body = [
        f"<h1>{title}</h1>",
        f'<p class="faint">{escape(who)} on the floating platform, thesis chapter 3, Tables 3.5 and 3.6</p>',
        f'<div class="verdict"><b>{escape(verdict(document))}</b></div>',
        *_faint([*missing(document), *notes(document)]),
    ]
    if poses:
        body += ["<h2>Go to pose under disturbances</h2>", _table(pose_heads(), poses), _key()]
    if paths:
        body += ["<h2>Paths followed at 0.2 m/s</h2>", _table(PATH_HEADS, paths)]
    if unmet(document):
        body += ["<h2>Asked and not met</h2>", *_faint(unmet(document))]
    body += ["<h2>Pictures</h2>", *map(shown, drawn)]
    body += ["<h2>Where this comes from</h2>", *origin(document, "drift.json")]
    return whole_page(title, body, style=_STYLE)


def _faint(lines: Iterable[str]) -> list[str]:
    return [f'<p class="faint">{escape(line)}</p>' for line in lines]


def _table(heads: Sequence[str], lines: Sequence[Line]) -> str:
    top = "".join(f"<th>{escape(head)}</th>" for head in ("", "", *heads))
    rows = "".join(
        f'<tr class="{line.kind}{" first" if line.title else ""}"><td>{escape(line.title)}</td>'
        f"<td>{escape(line.controller)}</td>{''.join(map(_cell, line.cells))}</tr>"
        for line in lines
    )
    return f'<div class="scroll"><table><tr>{top}</tr>{rows}</table></div>'


def _cell(cell: Cell) -> str:
    return f'<td class="{f"{cell.tone} {cell.band}".strip()}">{escape(cell.text + _MARKS[cell.tone])}</td>'


def _key() -> str:
    low, parts = 0.0, []
    for band in BANDS:
        parts.append(f'<span class="{band.name}">{low:.0f}–{band.most:.0f} %</span>')
        low = band.most
    return f'<p class="faint key">Behind the same controller\'s ideal row by {"".join(parts)}</p>'
