"""`fulmar report`: a page about one or several bags."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from fulmar_bags.bag_reading import BagReading
from fulmar_bringup.console import log_line, write_line
from fulmar_cli.commands.arguments import argument, flag, option
from fulmar_cli.commands.bag_reading import with_bag_options
from fulmar_core.config.errors import BagError, ConfigError


@with_bag_options()
def report(
    bags: Annotated[list[Path], argument("BAG...", "Bags of runs; several are compared.")],
    out: Annotated[
        Path | None,
        option(
            "FILE", "An .html page or a .png image; by default report.html in the bag, or comparison.html."
        ),
    ] = None,
    force: Annotated[
        bool, flag("--force", "Replace FILE even if it is not a report of the same bags.")
    ] = False,
    video: Annotated[
        Path | None,
        option(
            "FILE", "Make a film instead: .mp4, .webp or .gif; several bags side by side. It needs OpenGL."
        ),
    ] = None,
    size: Annotated[str, option("WIDTHxHEIGHT", "Of the film [px].")] = "960x540",
    fps: Annotated[
        float | None, option("HZ", "Frames a second of the film; by default 25, of .webp and .gif 12.5.")
    ] = None,
    speed: Annotated[float, option("X", "Seconds of the run a second of the film.")] = 1.0,
    span: Annotated[str, option("BEGIN,END", "Only this part of the runs [s].")] = "",
    *,
    reading: BagReading,
) -> None:
    """Make a report with plots from recorded runs, or with --video a film.

    Bags of controllers and recorders that are not Fulmar's need --task. Without it, or where a bag holds no goal, the
    report has the path, the speed, the actuators and the rates, and says what is missing.
    """
    if video is not None:
        from fulmar_cli.commands.film_options import film

        if out is not None:
            raise ConfigError("--out names a report and --video a film: make one at a time.")
        film(bags, video, size=size, fps=fps, speed=speed, span=span, force=force)
        return write_line(str(video))
    if fps is not None or span or speed != 1.0 or size != "960x540":
        raise ConfigError("--size, --fps, --speed and --span are of a film: give --video FILE as well.")
    from fulmar_bags.contents import open_bag
    from fulmar_bags.run_record import read_any_run
    from fulmar_evaluation.report.bag_report import write_bag_report
    from fulmar_evaluation.report.run_report import write_report
    from fulmar_evaluation.report.writer import default_report
    from fulmar_evaluation.rerun.embedded_configs import knowing_what_they_carry

    records = [read_any_run(bag, reading) for bag in bags]
    for record in records:
        for warning in record.warnings:
            log_line(f"warning: {warning}")
    with knowing_what_they_carry({bag: record.info for bag, record in zip(bags, records, strict=True)}):
        path = out or default_report(bags)
        try:
            write_report(records, path, force=force)
        except BagError as missing:
            if len(bags) > 1:
                raise
            log_line(f"warning: no result: {missing}")
            write_bag_report(open_bag(bags[0], reading), path, note=f"No result: {missing}", force=force)
    return write_line(str(path))
