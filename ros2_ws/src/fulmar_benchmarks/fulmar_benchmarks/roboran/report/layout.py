"""What every page of a benchmark is made of."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any

from fulmar_evaluation.report.page import STYLE
from fulmar_evaluation.report.plots import Picture
from fulmar_evaluation.report.style import as_svg

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


def whole_page(title: str, body: Sequence[str], *, style: str = "") -> str:
    """HTML that needs nothing from anywhere else.

    Args:
        title: Of the window.
        body: Elements in their order.
        style: Rules beside those of every benchmark.
    """
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{title}</title><style>{STYLE}{_OWN_STYLE}{style}</style></head><body>\n"
        + "\n".join(body)
        + "\n</body></html>\n"
    )


def shown(picture: Picture) -> str:
    """A picture with its title and its words."""
    wide = f"--wide: {_REM_PER_INCH * picture.figure.get_figwidth():.1f}rem"
    return (
        f'<h3>{escape(picture.title)}</h3><figure style="{wide}">{as_svg(picture.figure)}</figure>'
        f'<p class="faint">{escape(picture.caption)}</p>'
    )


def origin(document: dict[str, Any], file: str) -> list[str]:
    """Paragraphs on where the figures come from.

    Args:
        document: Has command, version and revision.
        file: Name of the file that has all figures.
    """
    lines = [f"<code>{escape(document['command'])}</code>"] if document["command"] else []
    revision = f", revision {document['git_revision']}" if document["git_revision"] else ""
    lines.append(escape(f"Fulmar {document['fulmar_version']}{revision}. All figures are in {file}."))
    return [f'<p class="faint">{line}</p>' for line in lines]
