"""`fulmar benchmark latency` and `fulmar benchmark endurance`: real time, measured."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from fulmar_bringup.console import output, print_result, write_line
from fulmar_bringup.progress import time_bar, work_bar
from fulmar_cli.commands.arguments import JsonOption, option
from fulmar_cli.commands.folders import dated_folder
from fulmar_core.config.errors import FAILED, ConfigError


def latency(
    rates: Annotated[
        str, option("HZ,...", "Commands a second, 5 to 500, with commas between.")
    ] = "5,10,20,50,100,200",
    seconds: Annotated[float, option("S", "Seconds of each measurement.", min=1.0)] = 6.0,
    executors: Annotated[str, option("E,...", "Executors of the nodes: events, default.")] = "events,default",
    as_json: JsonOption = False,
) -> None:
    """Measure the latency from a state through the controller to the actuators, at several rates.

    Plant (MuJoCo), controller (the shipped policy of go_to_pose) and recorder are processes, as `fulmar run` has them.
    Latency goes from where the plant publishes its state to where it has taken the command that answers it. Each rate
    is measured on an idle computer, and with a busy process for each core; with rclpy's EventsExecutor,
    which Fulmar uses, and with its default one. Nothing else should run meanwhile. The exit code is 1 unless at 50 Hz
    the 99th percentile is below 3 ms when idle and no watchdog trips under load.

    Try:

    fulmar benchmark latency --rates 50 --executors events
    """
    from fulmar_benchmarks.latency.cells import cells_of, measure
    from fulmar_cli.installation.extras import require

    require("onnxruntime", "mujoco")
    cells = cells_of(_rates(rates), _executors(executors))
    with work_bar("measuring") as moved:
        figures = measure(cells, seconds, lambda done: moved(done, len(cells)))
    print_result(figures, _print, as_json=as_json)
    if not figures["passed"]:
        raise typer.Exit(FAILED)


def endurance(
    simulated_s: Annotated[
        float, option("S", "Length, in the robot's own time.", "--seconds", min=10.0)
    ] = 3600.0,
    rate: Annotated[
        float, option("F", "Simulated seconds per second of wall-clock time.", min=0.1, max=10.0)
    ] = 1.0,
    out: Annotated[
        Path | None, option("DIR", "Folder of the bag; runs/benchmark/<time>... by default.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Run a system at 50 Hz of its own time for an hour: memory must not grow, and the bag must hold every command.

    The exit code is 1 if a node grows by 5 MB or more after a tenth of the time, or if the bag lacks a command that
    the plant has taken.

    Try:

    fulmar benchmark endurance --seconds 600 --rate 4
    """
    from fulmar_benchmarks.latency.endurance import endure
    from fulmar_cli.installation.extras import require

    require("onnxruntime", "mujoco")
    folder = out or dated_folder("runs/benchmark", "endurance")
    if folder.exists():
        raise ConfigError(
            f"{folder} exists already; nothing recorded is overwritten. Give --out another folder."
        )
    with time_bar("running", simulated_s) as moved:
        figures = endure(simulated_s=simulated_s, rate=rate, folder=folder, progress=moved)
    print_result(figures, _print_endurance, as_json=as_json)
    if not figures["passed"]:
        raise typer.Exit(FAILED)


def _rates(text: str) -> tuple[float, ...]:
    try:
        rates = tuple(float(part) for part in text.split(","))
    except ValueError:
        rates = ()
    if not rates or not all(5.0 <= hz <= 500.0 for hz in rates):
        raise ConfigError(f"--rates = '{text}' must be numbers from 5 to 500, with commas between.")
    return rates


def _executors(text: str) -> tuple[str, ...]:
    names = tuple(name.strip() for name in text.split(","))
    if not set(names) <= {"events", "default"}:
        raise ConfigError(f"--executors = '{text}' must be of events and default, with a comma between.")
    return names


def _print(figures: dict[str, Any]) -> None:
    table = Table(title=f"from state to command, {figures['seconds']:g} s each, {figures['cores']} cores")
    for column in ("load", "executor"):
        table.add_column(column)
    for column in (
        "Hz",
        "p50 ms",
        "p99 ms",
        "max ms",
        "period p99 ms",
        "trips",
        "CPU %: plant",
        "controller",
        "recorder",
    ):
        table.add_column(column, justify="right")
    for row in figures["cells"]:
        head = ("full" if row["loaded"] else "idle", row["executor"], f"{row['hz']:g}")
        if row["failure"]:
            table.add_row(*head, row["failure"])
            continue
        numbers = [row["latency_ms"][key] for key in ("p50", "p99", "max")]
        numbers.append(row["controller_period_error_ms"]["p99"])
        table.add_row(
            *head,
            *("-" if number is None else f"{number:.2f}" for number in numbers),
            str(row["watchdog_trips"]),
            *(f"{100.0 * row['cpu_share'][name]:.0f}" for name in ("plant", "controller", "recorder")),
        )
    output.print(table)
    for line in figures["required"]:
        write_line(f"{line['what']}: {line['value']} (limit {line['limit']:g})")


def _print_endurance(figures: dict[str, Any]) -> None:
    write_line(
        f"{figures['simulated_s']:g} s at {figures['rate']:g} times real time: "
        f"{figures['commands_lost']} of {figures['commands_answered']} commands are not in the bag"
    )
    for name, grown in figures["memory_growth_mb"].items():
        write_line(f"{name}: {figures['memory_mb'][name]:.0f} MB, grown by {grown:.1f} MB")
