"""`fulmar report`: one or several bags as a page to look at."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fulmar_bringup.console import console, output
from fulmar_core.errors import BagError


def report(
    bags: Annotated[list[Path], typer.Argument(metavar="BAG...", help="Bags of runs; several are compared.")],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="An .html page or a .png picture; by default report.html in the bag, or comparison.html.",
        ),
    ] = None,
    task: Annotated[
        str | None,
        typer.Option(metavar="T", help="Task of the runs, where a bag names none; from `fulmar list tasks`."),
    ] = None,
    robot: Annotated[
        str | None, typer.Option(metavar="R", help="Robot of the runs, where a bag names none.")
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Replace FILE even if it is no report of the same bags.")
    ] = False,
) -> None:
    """Make a report with pictures from recorded runs.

    Bags of controllers and recorders that are not Fulmar's need --task. Without it, or where a bag holds no goal, the
    report has the path, the speed, the actuators and the rates, and says what is missing.
    """
    from fulmar_bags.contents import open_bag
    from fulmar_bags.run_record import read_any_run
    from fulmar_core.tasks import load_task
    from fulmar_evaluation.report import write_report
    from fulmar_evaluation.report.bag_plots import write_pictures
    from fulmar_evaluation.report.sources import default_report
    from fulmar_evaluation.rerun.embedded_configs import knowing_what_they_carry

    if task is not None:
        load_task(task)
    records = [read_any_run(bag, task=task, robot=robot) for bag in bags]
    for record in records:
        for warning in record.warnings:
            console.print(f"warning: {warning}", markup=False, soft_wrap=True)
    with knowing_what_they_carry({bag: record.info for bag, record in zip(bags, records, strict=True)}):
        path = out or default_report(bags)
        try:
            write_report(records, path, force=force)
        except BagError as missing:
            if len(bags) > 1:
                raise
            console.print(f"warning: no result: {missing}", markup=False, soft_wrap=True)
            write_pictures(open_bag(bags[0]), path, note=f"No result: {missing}", force=force)
    output.print(str(path), markup=False, soft_wrap=True)
