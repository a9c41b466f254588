"""`fulmar bag plot`: a bag to look at."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fulmar_bringup.console import output, print_json
from fulmar_cli.commands.arguments import BagArgument, JsonOption
from fulmar_cli.commands.damage import finish, open_and_warn
from fulmar_cli.extras import require


def plot(
    bag: BagArgument,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="A page (.html) or a .png picture; may be repeated. By default both, beside the bag.",
        ),
    ] = None,
    odometry: Annotated[
        str | None, typer.Option(metavar="TOPIC", help="Which odometry, where a bag has several.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Draw a bag: trajectory, errors, actuators, latencies.

    A run of Fulmar is drawn with its goal and tolerances, as by `fulmar report`. Any other bag with odometry is drawn
    without: its path, its speed, its actuators, and how late its messages came.
    """
    require("matplotlib")
    from fulmar_evaluation.report.bag_plots import write_pictures
    from fulmar_evaluation.rerun.embedded_configs import knowing_what_it_carries

    opened = open_and_warn(bag)
    beside = bag if bag.is_dir() else bag.parent
    files = out or [beside / "plot.html", beside / "plot.png"]
    with knowing_what_it_carries(opened):
        if _has_a_task(bag) and odometry is None:
            from fulmar_bags.run_record import read_run
            from fulmar_evaluation.report import write_report

            record = read_run(bag)
            written = [write_report([record], file) for file in files]
        else:
            written = [write_pictures(opened, file, odometry) for file in files]
    if as_json:
        print_json({"bag": str(bag), "files": [str(file) for file in written]})
    else:
        for file in written:
            output.print(str(file), markup=False, soft_wrap=True)
    raise finish(opened)


def _has_a_task(bag: Path) -> bool:
    """Whether this is a run that can be judged."""
    from fulmar_bags.run_record import read_run
    from fulmar_core.errors import FulmarError
    from fulmar_evaluation.run_evaluation import judge

    try:
        return judge(read_run(bag)) is not None
    except FulmarError:
        return False
