"""`fulmar report`: one or several bags as a page to look at."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fulmar_bringup.console import console, output


def report(
    bags: Annotated[list[Path], typer.Argument(metavar="BAG...", help="Bags of runs; several are compared.")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="An .html page or a .png picture; beside the bag by default."),
    ] = None,
) -> None:
    """Make a report with pictures from recorded runs."""
    from fulmar_bringup.bag_reader import read_run
    from fulmar_bringup.bags.carried import knowing_what_they_carry
    from fulmar_bringup.report import write_report

    records = [read_run(bag) for bag in bags]
    for record in records:
        for warning in record.warnings:
            console.print(f"warning: {warning}", markup=False, soft_wrap=True)
    first = bags[0] if bags[0].is_dir() else bags[0].parent
    with knowing_what_they_carry({bag: record.info for bag, record in zip(bags, records, strict=True)}):
        path = write_report(records, out or first / "report.html")
    output.print(str(path), markup=False, soft_wrap=True)
