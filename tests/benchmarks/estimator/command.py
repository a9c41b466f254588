"""`fulmar benchmark estimator`: the state estimator beside the mean of 30 poses."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from fulmar_bringup.console import console, output, print_json
from fulmar_bringup.progress import step_bar
from fulmar_cli.commands.arguments import JsonOption, SeedOption, renamed
from fulmar_core.config.errors import FAILED


def estimator(
    robot: Annotated[
        str, typer.Option(metavar="R", help="A name from `fulmar list robots`.")
    ] = "floating_platform",
    settings: Annotated[
        str, typer.Option(metavar="NAME", help="A name from configs/estimators, or a .yaml file.")
    ] = "mocap_imu",
    latency_ms: Annotated[
        float,
        typer.Option(
            metavar="MS", min=0.0, max=500.0, help="How late poses come; the estimator is estimates."
        ),
    ] = 10.0,
    drives: Annotated[int, typer.Option(metavar="N", min=1, help="How many drives.")] = 3,
    seconds: Annotated[float, typer.Option(metavar="S", min=10.0, help="How long each drive is.")] = 40.0,
    plot: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw one drive into a PNG file.")] = None,
    old_plot: Annotated[Path | None, renamed("--picture", "--plot")] = None,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Compare the state estimator with the mean of 30 poses that RoboRAN deploys, on the same data.

    A robot is driven about in the core's dynamics at 200 Hz; its poses, at 200 Hz and at 25 Hz, and its inertial
    readings have the noise of the robot's YAML. Every figure is about what a controller receives at an instant,
    against the truth at that instant. Exit code 1 if the estimator's velocity error is more than half the mean's, or
    20 ms late.

    Try:

    fulmar benchmark estimator --plot estimator.png
    """
    import dataclasses

    from fulmar_cli.installation.extras import require
    from fulmar_core.robots.robot_file import load_robot

    plot = plot or old_plot
    require("filterpy", *(["matplotlib"] if plot else []))
    from fulmar_core.config.errors import ConfigError
    from fulmar_core.estimators.kinds import load_estimator
    from fulmar_core.estimators.motion.settings import PlanarMotionSettings
    from tests.benchmarks.estimator.comparison import MEAN, RATES_HZ, compare, requirements_met
    from tests.benchmarks.estimator.comparison import as_json as rows_of
    from tests.benchmarks.estimator.drive import drives as drive_about

    the_robot = load_robot(robot)
    loaded = load_estimator(settings)
    if not isinstance(loaded, PlanarMotionSettings):
        raise ConfigError(f"{settings}: this benchmark compares estimators of kind 'planar_motion' alone.")
    believed = dataclasses.replace(loaded, latency_s=latency_ms / 1e3)
    done = iter(range(1, 3 * len(RATES_HZ) + 1))
    with step_bar("estimating", 3 * len(RATES_HZ)) as progress:
        driven = drive_about(the_robot, count=drives, seconds=seconds, seed=seed)
        found = compare(driven, believed, the_robot.limits, latency_ms / 1e3, lambda: progress(next(done)))
    lines = requirements_met(found)
    figures: dict[str, Any] = {
        "robot": robot,
        "settings": settings,
        "latency_ms": latency_ms,
        "drives": drives,
        "seconds": seconds,
        "rows": rows_of(found),
        "required": lines,
    }
    if plot is not None:
        from fulmar_evaluation.report.style import as_png
        from tests.benchmarks.estimator.plot import draw

        plot.parent.mkdir(parents=True, exist_ok=True)
        plot.write_bytes(as_png(draw(driven[0], found, believed, the_robot.limits, latency_ms / 1e3)))
        console.print(f"drawn: {plot}", markup=False)
    if as_json:
        print_json(figures)
    else:
        _print(figures, MEAN)
    if not all(line["passed"] for line in lines):
        raise typer.Exit(FAILED)


def _print(figures: dict[str, Any], mean: str) -> None:
    table = Table(
        title=f"{figures['robot']} · {figures['drives']} drives of {figures['seconds']:g} s · "
        f"poses {figures['latency_ms']:g} ms late"
    )
    table.add_column("poses")
    table.add_column("method")
    for column in ("velocity off, mm/s", "turn rate off, mrad/s", "late, ms", "gain"):
        table.add_column(column, justify="right")
    for row in figures["rows"]:
        table.add_row(
            f"{row['pose_rate_hz']:g} Hz" if row["method"] == mean else "",
            row["method"],
            f"{1e3 * row['velocity_rmse_m_s']:.1f}",
            f"{1e3 * row['yaw_rate_rmse_rad_s']:.1f}",
            f"{row['delay_ms']:.1f}",
            f"{100.0 * row['gain_error']:+.1f} %",
        )
    output.print(table)
    for line in figures["required"]:
        output.print(
            f"{line['pose_rate_hz']:g} Hz: velocity error {line['rmse_share']:.2f} of the mean's "
            f"(at most {line['rmse_share_limit']:g}), {line['delay_ms']:.1f} ms late "
            f"(less than {line['delay_limit_ms']:g}): {'met' if line['passed'] else 'missed'}"
        )
