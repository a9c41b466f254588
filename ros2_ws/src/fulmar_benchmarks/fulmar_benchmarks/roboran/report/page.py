"""The report of a benchmark as one self-contained HTML page."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any

from fulmar_benchmarks.cells import BAD, GOOD, spoken
from fulmar_benchmarks.roboran.cells import head, missing, rows
from fulmar_benchmarks.roboran.report.layout import origin, shown, whole_page
from fulmar_benchmarks.roboran.tables import notes, verdict
from fulmar_core.figures import FIGURES, SUCCESS
from fulmar_evaluation.report.plots import Picture

_MARKS = {GOOD: " ✓", BAD: " ✗", "": ""}


def page(document: dict[str, Any], first: Picture, sections: Sequence[tuple[str, Sequence[Picture]]]) -> str:
    """Lay out the page.

    Args:
        document: Of the benchmark.
        first: The picture of everything.
        sections: Names of tasks with their pictures.

    Returns:
        HTML that needs nothing from anywhere else.
    """
    title = "Fulmar beside RoboRAN"
    tasks = dict.fromkeys(entry["task"] for entry in document["pairs"])
    drawn = dict(sections)
    body = [
        f"<h1>{title}</h1>",
        f'<p class="faint">{escape(_subtitle(document))}</p>',
        f'<div class="verdict"><b>{escape(verdict(document))}</b></div>',
        "<nav>" + "".join(f'<a href="#{task}">{escape(spoken(task))}</a>' for task in tasks) + "</nav>",
        shown(first),
        *(f'<p class="faint">{escape(line)}</p>' for line in notes(document)),
    ]
    for task in tasks:
        body.append(f'<h2 id="{task}">{escape(spoken(task))}</h2>')
        body.append(_table(task, [entry for entry in document["pairs"] if entry["task"] == task]))
        body += map(shown, drawn.get(task, ()))
    body += [
        "<h2>What the figures mean</h2>",
        f"<dl>{_meanings(document)}</dl>",
        "<h2>Where this comes from</h2>",
        *origin(document, "roboran.json"),
    ]
    return whole_page(title, body)


def _subtitle(document: dict[str, Any]) -> str:
    robots = ", ".join(spoken(robot) for robot in dict.fromkeys(e["robot"] for e in document["pairs"]))
    return f"{robots}: learned and classical controllers on the tasks of the El-Hariry thesis, chapter 4"


def _table(task: str, entries: Sequence[dict[str, Any]]) -> str:
    shown = [entry for entry in entries if entry["ways"]]
    lines = [f'<p class="faint">{escape(missing(entry))}</p>' for entry in entries if missing(entry)]
    if not shown:
        return "".join(lines)
    heads = "".join(f"<th>{escape(head(entry))}</th>" for entry in shown)
    body = "".join(
        f"<tr><td>{escape(row.title)}</td>"
        + "".join(
            f'<td class="{cell.tone}">{escape(cell.text + _MARKS[cell.tone])}</td>' for cell in row.cells
        )
        + "</tr>"
        for row in rows(task, shown)
    )
    return f'<div class="scroll"><table><tr><th></th>{heads}</tr>{body}</table></div>{"".join(lines)}'


def _meanings(document: dict[str, Any]) -> str:
    """Of the figures that are in the document."""
    used = {name for entry in document["pairs"] for way in entry["ways"].values() for name in way}
    entries = [("success", SUCCESS)]
    entries += [(figure.title, figure.meaning) for name, figure in FIGURES.items() if name in used]
    return "".join(
        f'<dt>{escape(title)}</dt><dd class="faint">{escape(meaning)}</dd>' for title, meaning in entries
    )
