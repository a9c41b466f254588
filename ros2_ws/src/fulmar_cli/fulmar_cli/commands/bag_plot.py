"""`fulmar bag plot`: plots of a bag."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from fulmar_bags.bag_reading import BagReading
from fulmar_bringup.console import print_json, write_line
from fulmar_cli.commands.arguments import BagArgument, JsonOption, OdometryOption, option
from fulmar_cli.commands.bag_reading import with_bag_options
from fulmar_cli.commands.damage import finish, open_and_warn
from fulmar_cli.installation.extras import require


@with_bag_options()
def plot(
    bag: BagArgument,
    out: Annotated[
        list[Path] | None,
        option("FILE", "A page (.html) or a .png image; may be repeated. By default both, beside the bag."),
    ] = None,
    odometry: OdometryOption = None,
    as_json: JsonOption = False,
    *,
    reading: BagReading,
) -> None:
    """Draw a bag: trajectory, errors, actuators, latencies.

    A run of Fulmar is drawn with its goal and tolerances, as by `fulmar report`. Any other bag with odometry is drawn
    without: its path, its speed, its actuators, and how late its messages came.
    """
    require("matplotlib")
    from fulmar_evaluation.report.bag_report import write_bag_report
    from fulmar_evaluation.rerun.embedded_configs import knowing_what_it_carries

    opened = open_and_warn(bag, reading)
    beside = bag if bag.is_dir() else bag.parent
    files = out or [beside / "plot.html", beside / "plot.png"]
    with knowing_what_it_carries(opened):
        if _has_a_task(bag, reading) and odometry is None:
            from fulmar_bags.run_record import read_any_run
            from fulmar_evaluation.report.run_report import write_report

            record = read_any_run(bag, reading)
            written = [write_report([record], file) for file in files]
        else:
            written = [write_bag_report(opened, file, odometry) for file in files]
    if as_json:
        print_json({"bag": str(bag), "files": [str(file) for file in written]})
    else:
        for file in written:
            write_line(str(file))
    raise finish(opened)


def _has_a_task(bag: Path, reading: BagReading) -> bool:
    """Whether this is a run that can be evaluated."""
    from fulmar_bags.run_record import read_any_run
    from fulmar_core.config.errors import FulmarError
    from fulmar_evaluation.run_evaluation import evaluate_run

    try:
        return evaluate_run(read_any_run(bag, reading)) is not None
    except FulmarError:
        return False
