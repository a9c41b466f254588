"""The report as one self-contained HTML page."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from html import escape

from fulmar_evaluation.report.plots import Picture
from fulmar_evaluation.report.style import FAINT, INK, PAPER, as_svg
from fulmar_evaluation.report.view import View
from fulmar_evaluation.report.words import rule, table, verdict

STYLE = f"""
:root {{ --ink: {INK}; --faint: #6b7280; --paper: {PAPER}; --card: #f4f5f7; --rule: #e3e5e9;
  color-scheme: light dark }}
@media (prefers-color-scheme: dark) {{
  :root {{ --ink: #e6e8ec; --faint: {FAINT}; --paper: #14171c; --card: #1d2128; --rule: #2c313a }}
}}
* {{ box-sizing: border-box }}
body {{ margin: 0 auto; max-width: 46rem; padding: 1.5rem 1rem 4rem;
  background: var(--paper); color: var(--ink); font: 1rem/1.55 system-ui, sans-serif }}
h1 {{ font-size: 1.6rem; line-height: 1.2; margin: 0 0 .3rem }}
h2 {{ font-size: 1.1rem; margin: 2.6rem 0 .4rem }}
p {{ margin: .4rem 0 }}
.faint, figcaption, td small {{ color: var(--faint); font-size: .9rem }}
.verdicts {{ display: grid; gap: .8rem; margin: 1.4rem 0 .8rem;
  grid-template-columns: repeat(auto-fit, minmax(16rem, 1fr)) }}
.verdict {{ background: var(--card); border-left: .3rem solid var(--run); border-radius: .5rem;
  padding: .9rem 1.1rem }}
.verdict b {{ font-size: 1.25rem }}
.scroll {{ overflow-x: auto }}
table {{ border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums }}
th, td {{ padding: .4rem .6rem; border-bottom: 1px solid var(--rule); text-align: right;
  white-space: nowrap }}
th:first-child, td:first-child {{ text-align: left; padding-left: 0; white-space: normal }}
td small {{ display: block; font-size: .8rem; line-height: 1.2 }}
.dot {{ display: inline-block; width: .7em; height: .7em; border-radius: 50%; background: var(--run);
  margin-right: .45em }}
figure {{ margin: 0; overflow-x: auto }}
figure svg {{ display: block; width: 100%; min-width: 27rem; height: auto; margin: .6rem 0 }}
figure svg text {{ font-family: system-ui, sans-serif !important }}
code {{ font-size: .85rem; overflow-wrap: anywhere }}
dt {{ margin-top: .7rem }} dd {{ margin: 0 }}
"""


def page(runs: Sequence[View], drawn: Sequence[Picture], title: str, mark: str) -> str:
    """Lay out the page.

    Args:
        runs: The runs, in the order of the columns.
        drawn: Pictures from `pictures`.
        title: Heading of the page.
        mark: Of the runs, from `sources.source_mark`.

    Returns:
        HTML that needs nothing from anywhere else.
    """
    body = [
        f"<h1>{escape(title)}</h1>",
        f'<p class="faint">{escape(_subtitle(runs))}</p>',
        f'<div class="verdicts">{"".join(map(_verdict, runs))}</div>',
        f'<p class="faint">{escape(rule(runs))}</p>',
        *(_warning(run) for run in runs if run.record.warnings),
        *(_beliefs(run) for run in runs if run.summary["beliefs"]),
        "<h2>In figures</h2>",
        _table(runs),
        *map(_figure, drawn),
        "<h2>Where this comes from</h2>",
        f"<dl>{''.join(map(_origin, runs))}</dl>",
    ]
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<meta name="fulmar-source" content="{escape(mark)}">'
        f"<title>{escape(title)}</title><style>{STYLE}</style></head><body>\n"
        + "\n".join(body)
        + "\n</body></html>\n"
    )


def _subtitle(runs: Sequence[View]) -> str:
    first = runs[0]
    parts = [str(first.summary["robot"] or "unknown robot").replace("_", " ")]
    if first.result is not None:
        parts.append(first.result.task.title)
    parts.append(f"{first.summary['backend']} backend")
    if len(first.record.motion):
        parts.append(datetime.fromtimestamp(float(first.record.motion.log_s[0])).strftime("%-d %B %Y, %H:%M"))
    return " · ".join(parts)


def _run_colour(run: View) -> str:
    return f'style="--run: {run.colour}"'


def _name(run: View) -> str:
    return f'<span class="dot"></span>{escape(run.label)}'


def _verdict(run: View) -> str:
    word, sentence = verdict(run)
    text = f"{_name(run)}<br><b>{word}</b><p>{escape(sentence)}</p>"
    return f'<div class="verdict" {_run_colour(run)}>{text}</div>'


def _warning(run: View) -> str:
    lines = "; ".join(run.record.warnings[:5])
    return f'<p class="faint">{escape(run.label)}: part of the bag could not be read. {escape(lines)}</p>'


def _beliefs(run: View) -> str:
    return f"<p>{_name(run)}: at the end of the run, {escape(run.summary['beliefs'])}.</p>"


def _table(runs: Sequence[View]) -> str:
    heads = "".join(
        f'<th {_run_colour(run)}><span class="dot"></span>{escape(run.label)}</th>' for run in runs
    )
    rows = "".join(
        f"<tr><td>{escape(what)}{f'<small>{escape(why)}</small>' if why else ''}</td>"
        + "".join(f"<td>{escape(cell)}</td>" for cell in cells)
        + "</tr>"
        for what, why, cells in table(runs)
    )
    return f'<div class="scroll"><table><tr><th></th>{heads}</tr>{rows}</table></div>'


def _figure(picture: Picture) -> str:
    return (
        f"<h2>{escape(picture.title)}</h2><figure>{as_svg(picture.figure)}</figure>"
        f'<p class="faint">{escape(picture.caption)}</p>'
    )


def _origin(run: View) -> str:
    info = run.record.info
    lines = [f"<code>{escape(str(info['command']))}</code>"] if info.get("command") else []
    if info.get("name") not in (None, "", info.get("robot")):
        lines.append(escape(f"{info['name']}, a {info.get('robot')}"))
    lines.append(
        f"bag <code>{escape(str(run.record.path))}</code>, seed {escape(str(info.get('seed', '–')))}"
    )
    versions = [f"Fulmar {info['fulmar_version']}"] if info.get("fulmar_version") else []
    versions += [f"revision {info['git_revision']}"] if info.get("git_revision") else []
    sha256 = run.record.controller.get("sha256")
    versions += [f"controller SHA-256 {str(sha256)[:16]}"] if sha256 else []
    lines.append(escape(", ".join(versions)))
    return f"<dt {_run_colour(run)}>{_name(run)}</dt>" + "".join(
        f'<dd class="faint">{line}</dd>' for line in lines if line
    )
