"""One HTML page that needs nothing from the network, built from paragraphs, tables and plots."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from matplotlib.figure import Figure

from fulmar_evaluation.report.style import FAINT, INK, PAPER, as_svg

_REM_PER_INCH = 6.7  # so that a figure of full width fills the page of a benchmark
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
.results {{ display: grid; gap: .8rem; margin: 1.4rem 0 .8rem;
  grid-template-columns: repeat(auto-fit, minmax(16rem, 1fr)) }}
.result {{ background: var(--card); border-left: .3rem solid var(--run); border-radius: .5rem;
  padding: .9rem 1.1rem }}
.result b {{ font-size: 1.25rem }}
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
BENCHMARK_STYLE = """
body { max-width: 64rem }
h2 { font-size: 1.35rem; border-top: 1px solid var(--rule); padding-top: 1.6rem }
h3 { font-size: 1.05rem; margin: 2rem 0 .4rem }
td.good { color: #15803d; font-weight: 600 } td.bad { color: #d6336c; font-weight: 600 }
@media (prefers-color-scheme: dark) { td.good { color: #5fcf8a } td.bad { color: #ff7aa2 } }
nav { display: flex; flex-wrap: wrap; gap: .2rem 1.1rem } nav a { color: inherit }
.result { --run: var(--faint); margin: 1.2rem 0 }
figure svg { min-width: min(40rem, var(--wide)); max-width: var(--wide) }
"""


@dataclass(frozen=True)
class Plot:
    """A drawn figure with its title and a caption for somebody who has never seen one."""

    title: str
    caption: str
    figure: Figure
    name: str = ""  # of its file, where it gets one


Part = str | Plot  # of a page: an element of HTML, or a plot


def html_page(
    title: str, parts: Iterable[Part], *, style: str = "", mark: str = "", heading: str = "h2"
) -> str:
    """Build a page; call inside `house_style`.

    Args:
        title: Of the page.
        parts: What follows the title, in order.
        style: Rules beside `STYLE`.
        mark: Of the runs, from `writer.source_mark`, where there are any.
        heading: Tag of the titles of plots.
    """
    body = [part if isinstance(part, str) else _plot(part, heading) for part in parts]
    source = f'<meta name="fulmar-source" content="{escape(mark)}">' if mark else ""
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"{source}<title>{escape(title)}</title><style>{STYLE}{style}</style></head><body>\n"
        + "\n".join([f"<h1>{escape(title)}</h1>", *body])
        + "\n</body></html>\n"
    )


def _plot(plot: Plot, heading: str) -> str:
    wide = f"--wide: {_REM_PER_INCH * plot.figure.get_figwidth():.1f}rem"
    return (
        f'<{heading}>{escape(plot.title)}</{heading}><figure style="{wide}">{as_svg(plot.figure)}</figure>'
        f'<p class="faint">{escape(" ".join(plot.caption.split()))}</p>'
    )


def faint(*lines: str) -> list[str]:
    """A paragraph of small print for each line."""
    return [f'<p class="faint">{escape(line)}</p>' for line in lines]


def table(heads: Sequence[str], rows: Iterable[str]) -> str:
    """A table of heads and rows that are HTML already; wide ones scroll."""
    return f'<div class="scroll"><table><tr>{"".join(heads)}</tr>{"".join(rows)}</table></div>'


def cells(texts: Iterable[str], tag: str = "td") -> str:
    """Cells of a table, from plain texts."""
    return "".join(f"<{tag}>{escape(text)}</{tag}>" for text in texts)


def headline(text: str) -> str:
    """The result of a benchmark in one sentence."""
    return f'<div class="result"><b>{escape(text)}</b></div>'


def origin(document: dict[str, Any], file: str) -> list[str]:
    """Section on where the figures of a benchmark come from."""
    command = f'<p class="faint"><code>{escape(document["command"])}</code></p>'
    revision = f", revision {document['git_revision']}" if document["git_revision"] else ""
    return [
        "<h2>Where this comes from</h2>",
        *([command] if document["command"] else []),
        *faint(f"Fulmar {document['fulmar_version']}{revision}. All figures are in {file}."),
    ]
