"""`fulmar benchmark falcon`: a ground-effect craft along the references of the thesis."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from fulmar_bringup.progress import work_bar
from fulmar_cli.commands.arguments import (
    CORES,
    JobsOption,
    JsonOption,
    PolicyOption,
    SeedOption,
    option,
)
from fulmar_cli.commands.benchmark_campaign import ReportOption, finish
from fulmar_cli.commands.values import read_names
from fulmar_cli.installation.extras import require
from fulmar_core.config.seeds import EVALUATION_SEED


def falcon(
    robot: Annotated[str, option("NAME", "An aircraft.")] = "airship_v7",
    tasks: Annotated[str, option("T,...", "Out of hold and a to f, or all.")] = "all",
    controllers: Annotated[str, option("C,...", "Out of lqi, lqr, mppi, pid and policy, or all.")] = "all",
    scenarios: Annotated[
        str,
        option("S,...", "Out of exact, calm, noise, delay, late, light, severe and all, or every, or usual."),
    ] = "usual",
    episodes: Annotated[
        int, option("N", "Flights of each cell; 1 with exact state on a path, at most 5 of mppi.", min=1)
    ] = 20,
    policy: PolicyOption = None,
    seed: SeedOption = EVALUATION_SEED,
    out: Annotated[Path, option("DIR", "Folder of the report and its figures.")] = Path(
        "runs/benchmark/falcon"
    ),
    jobs: JobsOption = CORES,
    report: ReportOption = True,
    as_json: JsonOption = False,
) -> None:
    """Fly a ground-effect craft along the references of the thesis, beside its Tables 5.2 and 5.6 to 5.8.

    Flights of 60 s in the core's dynamics: `hold` one metre over the water, and (a) to (f) of thesis §5.5.2. Scenarios:
    exact (state as it is), calm (sensors of 100 Hz with 0.05 m, 0.05 m/s, 0.01 rad, 0.01 rad/s), calm with twice the
    noise, measurements (`delay`) or commands (`late`) that are 20 ms late, light or severe Dryden turbulence, or noise,
    delay and light turbulence in `all`. `rmse_per_axis_m` is √(mean e² / 3), as the thesis prints it, `rmse_m` √(mean
    e²), `peak_error_m` the largest distance (`overshoot_m` in the thesis), `energy` the mean squared throttle,
    `energy_per_m` [s/m] that over the speed, medians over the flights that survive, and `wall_s` what the flights of a
    cell took side by side. The `usual` scenarios are exact, calm, light and severe of lqr and pid, exact of mppi, in 5
    flights that differ by the seeds of its noise, and all of them of lqi and policy. A flight survives if the hull
    touches no water and no angle of attack goes beyond 1.5 times the stall's.

    Try:

    fulmar benchmark falcon --tasks a,d --controllers lqi --scenarios exact,calm --json

    fulmar benchmark falcon --tasks hold --controllers policy --scenarios calm,light --episodes 256

    fulmar benchmark falcon --tasks a,b,c,d,e,f --controllers lqi,mppi,pid --scenarios exact
    """
    from fulmar_benchmarks.falcon.campaign import Request, run_falcon
    from fulmar_benchmarks.falcon.cells import CONTROLLERS, SCENARIOS, TASKS
    from fulmar_benchmarks.falcon.tables import lines

    chosen: tuple[str, ...] = ()
    if scenarios != "usual":
        chosen = tuple(read_names(scenarios, "scenario", tuple(SCENARIOS), every="every"))
    request = Request(
        robot,
        tuple(read_names(tasks, "task", TASKS)),
        tuple(read_names(controllers, "controller", CONTROLLERS)),
        chosen,
        episodes,
        seed,
        jobs,
        str(policy or ""),
    )
    if report:
        require("matplotlib")
        from fulmar_benchmarks.falcon.report import write_report
    with work_bar("flights") as progress:
        document, flights = run_falcon(request, progress)
    finish(
        "falcon", document, out, lines_of=lines, as_json=as_json,
        write_report=(lambda: write_report(document, flights, out)) if report else None,
    )  # fmt: skip
