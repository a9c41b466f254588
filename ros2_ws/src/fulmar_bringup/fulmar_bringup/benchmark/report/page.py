"""The report of a benchmark as one self-contained HTML page."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any

from fulmar_bringup.benchmark.cells import BAD, GOOD, head, missing, rows, spoken
from fulmar_bringup.benchmark.tables import notes, verdict
from fulmar_bringup.report.page import STYLE
from fulmar_bringup.report.pictures import Picture
from fulmar_bringup.report.style import as_svg
from fulmar_core.figures import FIGURES, SUCCESS

_MARKS = {GOOD: " ✓", BAD: " ✗", "": ""}
_REM_PER_INCH = 6.7  # so that a picture of full width fills the page
_OWN_STYLE = """
body { max-width: 64rem }
h2 { font-size: 1.35rem; border-top: 1px solid var(--rule); padding-top: 1.6rem }
h3 { font-size: 1.05rem; margin: 2rem 0 .4rem }
td.good { color: #15803d; font-weight: 600 } td.bad { color: #d6336c; font-weight: 600 }
@media (prefers-color-scheme: dark) { td.good { color: #5fcf8a } td.bad { color: #ff7aa2 } }
nav { display: flex; flex-wrap: wrap; gap: .2rem 1.1rem } nav a { color: inherit }
.verdict { --run: var(--faint); margin: 1.2rem 0 }
figure svg { min-width: min(40rem, var(--wide)); max-width: var(--wide) }
"""


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
        _figure(first),
        *(f'<p class="faint">{escape(line)}</p>' for line in notes(document)),
    ]
    for task in tasks:
        body.append(f'<h2 id="{task}">{escape(spoken(task))}</h2>')
        body.append(_table(task, [entry for entry in document["pairs"] if entry["task"] == task]))
        body += map(_figure, drawn.get(task, ()))
    body += [
        "<h2>What the figures mean</h2>",
        f"<dl>{_meanings(document)}</dl>",
        "<h2>Where this comes from</h2>",
        *(f'<p class="faint">{line}</p>' for line in _origin(document)),
    ]
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{title}</title><style>{STYLE}{_OWN_STYLE}</style></head><body>\n"
        + "\n".join(body)
        + "\n</body></html>\n"
    )


def _subtitle(document: dict[str, Any]) -> str:
    robots = ", ".join(spoken(robot) for robot in dict.fromkeys(e["robot"] for e in document["pairs"]))
    return f"{robots}: learned and classical controllers on the tasks of the El-Hariry thesis, chapter 4"


def _figure(picture: Picture) -> str:
    wide = f"--wide: {_REM_PER_INCH * picture.figure.get_figwidth():.1f}rem"
    return (
        f'<h3>{escape(picture.title)}</h3><figure style="{wide}">{as_svg(picture.figure)}</figure>'
        f'<p class="faint">{escape(picture.caption)}</p>'
    )


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


def _origin(document: dict[str, Any]) -> list[str]:
    lines = [f"<code>{escape(document['command'])}</code>"] if document["command"] else []
    revision = f", revision {document['git_revision']}" if document["git_revision"] else ""
    lines.append(escape(f"Fulmar {document['fulmar_version']}{revision}. All figures are in roboran.json."))
    return lines
