"""`fulmar benchmark events`: turn rates from the events of cameras that look at the stars."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from fulmar_bringup.progress import work_bar
from fulmar_cli.commands.arguments import CORES, JobsOption, JsonOption, SeedOption, option
from fulmar_cli.commands.benchmark_campaign import ReportOption, finish
from fulmar_cli.commands.values import read_names
from fulmar_cli.installation.extras import require
from fulmar_core.config.seeds import EVALUATION_SEED


def events(
    runs: Annotated[int, option("N", "Random windows, of the table and of each field of view.", min=4)] = 100,
    seed: SeedOption = EVALUATION_SEED,
    parts: Annotated[
        str,
        option("P,...", "Out of table, fields (of view), sensitivity, slow_and_fast and pointing, or all."),
    ] = "all",
    pointing_runs: Annotated[
        int, option("N", "Episodes of nadir pointing without a gyroscope, 3 min of a core each.", min=1)
    ] = 2,
    pointing_s: Annotated[float, option("S", "Length of these episodes [s].", min=120.0)] = 600.0,
    out: Annotated[Path, option("DIR", "Folder of the report and its figures.")] = Path(
        "runs/benchmark/events"
    ),
    jobs: JobsOption = CORES,
    report: ReportOption = True,
    as_json: JsonOption = False,
) -> None:
    """Estimate turn rates from simulated events of real stars, beside thesis Table 6.2.

    Cameras of 8.5° and 1024 × 1024 pixels see stars to magnitude 7; pixels have a threshold of 0.25 ± 0.03, 0.1 Hz of
    noise and time stamps that jitter by 100 µs. Attitudes are random, rates from 0.1 to 2 °/s about any axis. No search
    starts at the truth. Errors are in °/s about the first camera's axes: p and q across its boresight, r about it.
    `nees_inside` is the share of windows whose normalised error squared is below the 95 % limit of chi-squared with
    three degrees of freedom. `pointing` is a satellite that goes on pointing to the nadir when its gyroscope dies.

    Try:

    fulmar benchmark events --runs 20 --parts table,fields --json
    """
    require("mujoco")
    from fulmar_benchmarks.events.campaign import PARTS, Request, run_events
    from fulmar_benchmarks.events.tables import lines
    from fulmar_core.robots.sensors.catalogue import load_stars

    load_stars()
    chosen = read_names(parts, "part", PARTS)
    request = Request(runs, seed, tuple(chosen), pointing_runs, pointing_s, jobs)
    if report:
        require("matplotlib")
        from fulmar_benchmarks.events.report import write_report
    with work_bar("windows") as progress:
        document = run_events(request, progress)
    finish(
        "events", document, out, lines_of=lines, as_json=as_json,
        write_report=(lambda: write_report(document, out)) if report else None,
    )  # fmt: skip
