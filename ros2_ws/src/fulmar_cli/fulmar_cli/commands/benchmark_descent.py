"""`fulmar benchmark descent`: aircraft whose controller is killed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fulmar_bringup.console import print_result, write_line
from fulmar_bringup.progress import work_bar
from fulmar_cli.commands.arguments import (
    CORES,
    JobsOption,
    JsonOption,
    PolicyOption,
    ScenarioOption,
    SeedOption,
    option,
)
from fulmar_cli.commands.values import read_names
from fulmar_core.config.errors import FAILED, ConfigError
from fulmar_core.config.seeds import EVALUATION_SEED

HIGHEST_M = 100.0


def descent(
    robot: Annotated[str, option("NAME", "An aircraft.")] = "airship_v7",
    controller: Annotated[
        str, option("C", "What flies until it is killed: lqi, lqr, mppi, pid or policy.")
    ] = "lqi",
    policy: PolicyOption = None,
    heights: Annotated[str, option("M,...", "Heights at which it is killed [m].")] = "1,5",
    flights: Annotated[int, option("N", "Flights at each height.", min=1)] = 64,
    through: Annotated[str, option("W,...", "Out of batch, lockstep and realtime, or all.")] = "all",
    real_time: Annotated[int, option("N", "Flights in real time at each height.", min=1)] = 4,
    seed: SeedOption = EVALUATION_SEED,
    scenario: ScenarioOption = "nominal",
    jobs: JobsOption = CORES,
    as_json: JsonOption = False,
) -> None:
    """Kill the controller of an aircraft in flight, and measure how the safe controller brings it down.

    Each flight holds its height for 4 to 6 s. Then its controller's process gets SIGKILL; until its hull touches the
    ground the plant's guard flies it, by the state that the plant measures. `lockstep`: plant and controller are the
    nodes of `fulmar run`, in lock step up to the kill; after it no command answers, and the plant steps through
    simulated time on its own. `realtime`: each node is a process, by the clock. `batch`: the same guard in the core's
    own dynamics, without ROS. A flight is good if its bank stays within 10 degrees until touch-down and it sinks by at
    most 1 m/s then. The exit code is 1 unless 60 of 64 are.

    Try:

    fulmar benchmark descent --flights 8 --through batch,lockstep
    """
    from fulmar_benchmarks.descent.campaign import WAYS, Request, run_descents
    from fulmar_benchmarks.descent.flights import Flights
    from fulmar_benchmarks.descent.tables import print_tables

    folder = str(Path(policy).absolute()) if policy else ""
    each = tuple(
        Flights(robot, controller, height, flights, seed, scenario, folder) for height in _heights(heights)
    )
    for one in each:
        one.check()
    request = Request(each, tuple(read_names(through, "way", WAYS)), real_time, jobs)
    with work_bar("flights") as progress:
        document = run_descents(request, progress)
    print_result(document, lambda found: print_tables(found, write_line), as_json=as_json)
    if not document["passed"]:
        raise typer.Exit(FAILED)


def _heights(text: str) -> tuple[float, ...]:
    try:
        heights = tuple(float(part) for part in text.split(","))
    except ValueError:
        heights = ()
    if not heights or not all(0.0 < height <= HIGHEST_M for height in heights):
        raise ConfigError(
            f"--heights = '{text}' must be numbers above 0, at most {HIGHEST_M:g} m, with commas between."
        )
    return heights
