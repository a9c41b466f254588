"""`fulmar benchmark recorder`: what recording costs and what it loses."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from fulmar_bringup.console import console, output, print_json
from fulmar_cli.commands.arguments import JsonOption
from fulmar_core.config.errors import FAILED, ConfigError, UnknownNameError


def recorder(
    parts: Annotated[
        str,
        typer.Option(
            metavar="P,...", help="Of cost, loss, lockstep, kills, with commas between; all by default."
        ),
    ] = "cost,loss,lockstep,kills",
    stretches: Annotated[
        int, typer.Option(metavar="N", min=2, help="Cost: stretches with a recorder, and as many without.")
    ] = 16,
    stretch_s: Annotated[
        float, typer.Option(metavar="S", min=1.0, help="Cost: length of a stretch [s].")
    ] = 10.0,
    loss_s: Annotated[
        float, typer.Option(metavar="S", min=1.0, help="Loss: length of the traffic [s].")
    ] = 600.0,
    lockstep_hz: Annotated[
        float, typer.Option(metavar="HZ", min=0.1, help="Lock step: steps a simulated second.")
    ] = 25.0,
    lockstep_s: Annotated[
        float, typer.Option(metavar="S", min=1.0, help="Lock step: simulated seconds.")
    ] = 1500.0,
    kills: Annotated[int, typer.Option(metavar="N", min=1, help="Kills: recorders that die.")] = 50,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of the bags; runs/benchmark/<time>... by default."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Measure what recording costs the control loop and what it loses.

    cost: latency from odometry to command, 200 and 50 a second, with a recorder and without one in turns; the 99th
    percentile may grow by 5 %. loss: ten minutes at these rates; no message may be missing. lockstep: at least 20 times
    as fast as real time; no message of any step may be missing. kills: SIGKILL at random moments; every bag must open
    with two readers and lack one second at most. The exit code is 1 if one of them is not so.

    Try:

    fulmar benchmark recorder --parts loss,kills --loss-s 30 --kills 10 --json
    """
    from fulmar_cli.installation.extras import require
    from tests.benchmarks.recorder.document import PARTS, Asked, measure

    names = tuple(name.strip() for name in parts.split(","))
    for name in names:
        if name not in PARTS:
            raise UnknownNameError("part", name, PARTS)
    require("mujoco", "rclpy", "mcap", "rosbags")
    out = out or Path("runs") / "benchmark" / f"{time.strftime('%Y%m%d_%H%M%S')}_recorder"
    if out.exists():
        raise ConfigError(
            f"{out} exists already; nothing recorded is overwritten. Give --out another folder."
        )
    with console.status("recorder") as status:
        found = measure(
            Asked(names, stretches, stretch_s, loss_s, lockstep_hz, lockstep_s, kills, out), status.update
        )
    if as_json:
        print_json(found)
    else:
        for line in in_words(found):
            output.print(line, markup=False, soft_wrap=True)
    if not found["passed"]:
        raise typer.Exit(FAILED)


def in_words(found: dict[str, Any]) -> list[str]:
    """The figures in words."""
    return [
        f"{name + ':':<10} {'yes' if figures['passed'] else 'NO ':<4} {_WORDS[name](figures)}"
        for name, figures in found.items()
        if name in _WORDS
    ]


def _cost(figures: dict[str, Any]) -> str:
    with_it, without = figures["recorded"], figures["not_recorded"]
    low, high = figures["p99_ratio_of_pairs_median_95"]
    return (
        f"latency p99 {with_it['p99_ms']:.3f} ms recorded, {without['p99_ms']:.3f} ms not recorded: "
        f"ratio {figures['p99_ratio']:.3f}; of neighbours {figures['p99_ratio_of_pairs_median']:.3f} in the median "
        f"(95 %: {low:.3f} to {high:.3f}; at most {figures['allowed']}); "
        f"p50 {with_it['p50_ms']:.3f} and {without['p50_ms']:.3f} ms; "
        f"{with_it['commands'] + without['commands']} commands"
    )


def _loss(figures: dict[str, Any]) -> str:
    return (
        f"{sum(figures['lost'].values())} of {figures['sent']} messages lost in {figures['seconds']:.0f} s at "
        f"{figures['odometry_hz']:.0f} and {figures['command_hz']:.0f} Hz; the recorder used "
        f"{100 * figures['cpu_share']:.0f} % of a core"
    )


def _lockstep(figures: dict[str, Any]) -> str:
    failure = f"; {figures['failure']}" if figures["failure"] else ""
    return (
        f"{sum(figures['lost'].values())} of {figures['sent']} messages lost at {figures['times_real_time']:.0f} times "
        f"real time, {figures['control_hz']:g} steps a simulated second{failure}"
    )


def _kills(figures: dict[str, Any]) -> str:
    missing = figures["missing_at_the_end_s"]
    ends = f"missing at the end: {missing['median']:.2f} s median, {missing['max']:.2f} s at most"
    opened, torn = figures["opened_by_rosbags_and_mcap"], figures["bags_with_gaps"]
    return f"{opened} of {figures['kills']} bags open, {torn} with gaps; {ends}"


_WORDS = {"cost": _cost, "loss": _loss, "lockstep": _lockstep, "kills": _kills}
