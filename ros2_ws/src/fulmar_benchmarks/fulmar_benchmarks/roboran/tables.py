"""The document of a benchmark as tables in a terminal."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from fulmar_benchmarks.cells import BAD, GOOD, spoken
from fulmar_benchmarks.roboran.cells import head, missing, rows

_MARKS = {GOOD: "[green]{} ✓[/]", BAD: "[bold red]{} ✗[/]", "": "{}"}
_PLACES = {"batch": "the batch", "mujoco": "MuJoCo", "ros": "ROS"}
_WIDTH = 140  # where nobody looks at a terminal, lines need not fit one


def print_tables(document: dict[str, Any], output: Console) -> None:
    """Print one table a task, what the figures are, and the conclusion.

    Args:
        document: Of `roboran`.
        output: Where to.
    """
    width = None if output.is_terminal else _WIDTH
    wide = output if width is None else Console(highlight=False, emoji=False, width=width)
    for task in dict.fromkeys(entry["task"] for entry in document["pairs"]):
        entries = [entry for entry in document["pairs"] if entry["task"] == task]
        shown = [entry for entry in entries if entry["ways"]]
        if shown:
            wide.print(_table(task, shown))
        for entry in entries:
            if missing(entry):
                wide.print(f"{spoken(task)}, {missing(entry)}", markup=False, style="yellow", soft_wrap=True)
    for line in notes(document):
        wide.print(line, markup=False, soft_wrap=True)
    wide.print(conclusion(document), markup=False, soft_wrap=True)


def conclusion(document: dict[str, Any]) -> str:
    """One sentence on what was asked and met."""
    asked, met, open_ = document["asked"], document["met"], document["open"]
    return f"{met} of {asked} pairs meet everything that is asked of them" + (
        f"; {open_} could not be judged in full." if open_ else "."
    )


def notes(document: dict[str, Any]) -> list[str]:
    """What one has to know to read the tables."""
    ways = ", ".join(
        f"{episodes:,} episodes in {_PLACES[way]}" for way, episodes in document["episodes"].items()
    )
    lines = [
        f"{ways}; scenario {document['scenario']}, seed {document['seed']}. In brackets: the thesis (Tables 4.6 and "
        "4.7, its times from control steps at 10 Hz; its control variation is another sum). Figures below the line of "
        "training are means over the episodes of the first way."
    ]
    seen: dict[str, str] = {}
    for entry in document["pairs"]:
        for way in entry["ways"].values():
            if "bound" in way:
                seconds = f"1,000 steps are {way['thousand_steps_s']:g} s"
                seen[spoken(entry["robot"])] = f"{way['bound']}; {seconds} at {way['control_hz']:g} Hz"
    lines += [f"bound for {robot}: {rule}." for robot, rule in seen.items()]
    compared = [entry for entry in document["pairs"] if entry["same_at_64_worlds"] is not None]
    if compared:
        same = sum(entry["same_at_64_worlds"] for entry in compared)
        lines.append(
            f"{same} of {len(compared)} pairs give the same numbers, bit for bit, in small batches as in large ones."
        )
    return lines


def _table(task: str, entries: list[dict[str, Any]]) -> Table:
    table = Table(title=spoken(task), title_justify="left")
    table.add_column("")
    for entry in entries:
        table.add_column(head(entry), justify="right")
    for row in rows(task, entries):
        table.add_row(escape(row.title), *(_MARKS[cell.tone].format(cell.text) for cell in row.cells))
    return table
