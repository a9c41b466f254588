"""`fulmar benchmark hardware`: closed loops through emulated devices, driver and protocol, in real time."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from fulmar_bringup.console import output, print_json
from fulmar_bringup.progress import work_bar
from fulmar_cli.commands.arguments import JsonOption
from fulmar_core.config.errors import FAILED, UnknownNameError
from tests.benchmarks.closed_loops import Command


@dataclass(frozen=True)
class HardwareCase:
    """A device and what it is asked to do."""

    name: str  # of a file in configs/hardware
    task: str

    @property
    def robot(self) -> str:
        """Whose device it is."""
        from hardware_drivers.hardware import load_hardware

        return load_hardware(self.name).robot

    def prepared(self, _seed: int) -> contextlib.AbstractContextManager[Command]:
        """An emulator stands in for the device."""
        from hardware_drivers.hardware import load_hardware
        from hardware_drivers.settings import MavlinkBoat

        arm = ("--arm",) if isinstance(load_hardware(self.name).driver, MavlinkBoat) else ()
        device = ("--backend", "hardware", "--hardware", self.name, "--emulate", *arm)
        return contextlib.nullcontext(Command((), device, {}))

    def about(self) -> dict[str, Any]:
        """The device and what drives it."""
        from hardware_drivers.hardware import load_hardware

        return {"hardware": self.name, "driver": load_hardware(self.name).driver.kind}


CASES = (
    HardwareCase("zero_g_lab", "go_to_pose"),
    HardwareCase("turtlebot2", "go_to_position"),
    HardwareCase("kingfisher", "go_to_position"),
    HardwareCase("kingfisher_ardupilot", "go_to_position"),
)


def cases_of(names: Iterable[str] | None) -> list[HardwareCase]:
    """The cases of some hardware files, or all.

    Raises:
        UnknownNameError: A file has none.
    """
    if names is None:
        return list(CASES)
    known = {case.name: case for case in CASES}
    for name in names:
        if name not in known:
            raise UnknownNameError("emulated device", name, known)
    return [known[name] for name in names]


def hardware(
    only: Annotated[
        str | None,
        typer.Option(
            "--hardware",
            metavar="F,...",
            help="Files of configs/hardware, with commas between; all by default.",
        ),
    ] = None,
    episodes: Annotated[int, typer.Option(metavar="N", min=1, help="Episodes of each device.")] = 40,
    seconds: Annotated[
        float | None,
        typer.Option(metavar="S", min=5.0, help="Length of an episode; the task's own by default."),
    ] = None,
    jobs: Annotated[
        int,
        typer.Option(metavar="N", min=1, max=32, help="Systems beside each other, five processes each."),
    ] = 3,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Keep what came of each episode, and do not repeat what is there."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Drive emulated devices to their goals, through driver and wire protocol, in real time, with the shipped policies.

    Each episode is `fulmar run --backend hardware --emulate` with a seed of its own. Success is that of `fulmar run`,
    evaluated by where the emulated robot really is: within the tolerance throughout the closing seconds of the episode.
    With --out, a campaign that was broken off goes on where it was. The exit code is 1 where a device reaches its goal
    too rarely.

    Try:

    fulmar benchmark hardware --hardware turtlebot2 --episodes 8 --seconds 25
    """
    from fulmar_bringup.system import modules_of
    from fulmar_cli.installation.extras import require
    from tests.benchmarks.closed_loops import Campaign, measure

    cases = cases_of([name.strip() for name in only.split(",")] if only else None)
    for case in cases:
        require(*modules_of("policy", "hardware", hardware=case.name, emulated=True))
    total = len(cases) * episodes
    with work_bar("driving") as moved:
        found = measure(cases, Campaign(episodes, seconds, jobs, out), lambda done: moved(done, total))
    if as_json:
        print_json({"cases": found, "jobs": jobs, "passed": all(case["passed"] for case in found)})
    else:
        _print(found)
    if not all(case["passed"] for case in found):
        raise typer.Exit(FAILED)


def _print(found: list[dict[str, Any]]) -> None:
    table = Table(title="goals reached through emulated devices")
    for column in ("hardware", "driver", "task"):
        table.add_column(column)
    for column in ("reached", "share", "required", "watchdog trips"):
        table.add_column(column, justify="right")
    for case in found:
        table.add_row(
            case["hardware"],
            case["driver"],
            case["task"],
            f"{case['succeeded']}/{case['episodes']}",
            f"{case['share']:.3f}",
            f"{case['required']:.2f}",
            str(case["watchdog_trips"]),
        )
    output.print(table)
    for case in found:
        for missed in case["missed"]:
            why = missed["failure"] or f"{missed['final_position_error_m']:.2f} m off"
            output.print(f"  {case['hardware']}, seed {missed['seed']}: {why}", markup=False)
