"""Tables and lines of a document, written once for terminals and pages."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape

import rich.table
from rich.console import Console
from rich.text import Text

DISPLAY_NAMES = {
    "floating_platform": "floating platform",
    "kingfisher": "Kingfisher",
    "turtlebot2": "Turtlebot2",
    "go_to_position": "Go to position",
    "go_to_pose": "Go to pose",
    "track_velocities": "Track velocities",
    "go_through_positions": "Go through positions",
    "go_to_position_with_obstacles": "Go to position with obstacles",
    "int_ball2": "Int-Ball2",
    "go_to_position_3d": "Go to position 3-D",
    "go_to_pose_3d": "Go to pose 3-D",
    "track_velocities_3d": "Track velocities 3-D",
    "go_through_positions_3d": "Go through positions 3-D",
    "go_through_poses_3d": "Go through poses 3-D",
}
GOOD, BAD = "good", "bad"
MARKS = {
    GOOD: (" ✓", "green"),
    BAD: (" ✗", "bold red"),
    "": ("", ""),
}  # behind an entry of that tone, and its style
NOTHING = "–"
LONGEST = 150  # characters of a line that keeps its columns


def display_name(name: str) -> str:
    """Name of a robot or task in tables and reports."""
    return DISPLAY_NAMES.get(name, name.replace("_", " "))


def number(value: float | None, digits: int, nothing: str = NOTHING) -> str:
    """A number, or a dash."""
    return nothing if value is None else f"{value:.{digits}f}"


def tone_of(met: bool | None) -> str:
    """Tone of a requirement; None: not measured."""
    return "" if met is None else GOOD if met else BAD


@dataclass(frozen=True)
class Entry:
    """What is written, how it compares with what is required, and how it looks besides."""

    text: str
    tone: str = ""  # GOOD, BAD, or nothing to say
    band: str = ""  # class on a page, and style of `Table.bands`

    @property
    def html(self) -> str:
        """A cell of a page."""
        return (
            f'<td class="{f"{self.tone} {self.band}".strip()}">{escape(self.text + MARKS[self.tone][0])}</td>'
        )


@dataclass(frozen=True)
class Row:
    """One row of a table."""

    entries: tuple[Entry, ...]
    kind: str = ""  # class on a page, and style of `Table.kinds`
    last: bool = False  # of its section


@dataclass(frozen=True)
class Table:
    """Rows below heads; the first `words` columns are text, the others numbers."""

    title: str
    heads: Sequence[str]
    rows: Sequence[Row]
    words: int = 1
    bands: Mapping[str, str] = field(default_factory=dict)  # styles of a terminal
    kinds: Mapping[str, str] = field(default_factory=dict)

    def rich(self) -> rich.table.Table:
        """For a terminal."""
        table = rich.table.Table(title=self.title, title_justify="left")
        for place, head in enumerate(self.heads):
            table.add_column(
                head, justify="left" if place < self.words else "right", no_wrap=place < self.words
            )
        for row in self.rows:
            table.add_row(*(self._text(each, row) for each in row.entries), end_section=row.last)
        return table

    def _text(self, entry: Entry, row: Row) -> Text:
        style = f"{self.kinds.get(row.kind, '')} {self.bands.get(entry.band, '')}".strip()
        return Text(entry.text, style=style).append(*MARKS[entry.tone])

    def html(self) -> str:
        """For a page."""
        heads = "".join(f"<th>{escape(head)}</th>" for head in self.heads)
        rows = (
            f'<tr class="{row.kind}">{"".join(each.html for each in row.entries)}</tr>' for row in self.rows
        )
        return f'<div class="scroll"><table><tr>{heads}</tr>{"".join(rows)}</table></div>'


Shown = str | Table


def print_shown(shown: Iterable[Shown], output: Console, width: int) -> None:
    """Print lines and tables; in so many columns where the output is not a terminal."""
    console = output if output.is_terminal else Console(highlight=False, emoji=False, width=width)
    for each in shown:
        if isinstance(each, Table):
            console.print(each.rich())
        else:
            console.print(each, markup=False, soft_wrap=True)


def shown_as_html(shown: Iterable[Shown]) -> list[str]:
    """Lines and tables as parts of a page; lines that follow one another keep their columns."""
    parts: list[str] = []
    lines: list[str] = []
    for each in [*shown, None]:
        if isinstance(each, str) and len(each) <= LONGEST:
            lines.append(each)
            continue
        if lines:
            parts.append(f"<pre>{escape(chr(10).join(lines))}</pre>")
            lines = []
        if isinstance(each, str):
            parts.append(f'<p class="faint">{escape(each)}</p>')
        elif each is not None:
            parts += [f"<h2>{escape(each.title)}</h2>", each.html()]
    return parts
