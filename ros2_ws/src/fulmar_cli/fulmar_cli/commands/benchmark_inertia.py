"""`fulmar benchmark inertia`: inertia of satellites from their wheels and gyroscopes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from fulmar_bringup.progress import work_bar
from fulmar_cli.commands.arguments import CORES, JobsOption, JsonOption, SeedOption, option
from fulmar_cli.commands.benchmark_campaign import ReportOption, finish
from fulmar_cli.commands.values import read_names
from fulmar_cli.installation.extras import require
from fulmar_core.config.seeds import EVALUATION_SEED


def inertia(
    satellites: Annotated[
        str, option("S,...", "Out of cubesat_wheels, microsat and smallsat, or all.")
    ] = "all",
    profiles: Annotated[
        str, option("P,...", "Out of the eight of the study and `persistent`, our own, or all.")
    ] = "all",
    draws: Annotated[
        int, option("N", "Draws of sensor noise for each static cell; the worst counts.", min=1)
    ] = 3,
    seed: SeedOption = EVALUATION_SEED,
    out: Annotated[Path, option("DIR", "Folder of the report and its figures.")] = Path(
        "runs/benchmark/inertia"
    ),
    jobs: JobsOption = CORES,
    report: ReportOption = True,
    as_json: JsonOption = False,
) -> None:
    """Estimate the inertia of three satellites under nine excitations, beside thesis Figs. 6.8 and 6.9.

    Each run lasts 300 s, from rest, sampled at 10 Hz; profiles have the amplitudes of the study (arXiv 2510.16738), so
    that some wheels run at their top speed. Estimators: batch least squares (ls), least squares with forgetting (rls)
    and an extended Kalman filter (ekf), which begin at 0.8 or 0.85 of the truth. `error_max` is the largest relative
    error of a moment, `saturated` the share of the time with a wheel at its top speed. `dynamic` has an inertia that
    steps by 10 % at half time, drifts by 5 %, or swings by 3 % in 50 s. It takes two minutes on two cores.

    Try:

    fulmar benchmark inertia --satellites microsat --profiles chirp,persistent --json
    """
    from fulmar_benchmarks.inertia.campaign import PROFILES, SATELLITES, Request, run_inertia
    from fulmar_benchmarks.inertia.tables import lines

    names = read_names(satellites, "satellite", SATELLITES), read_names(profiles, "profile", PROFILES)
    request = Request(tuple(names[0]), tuple(names[1]), draws, seed, jobs)
    if report:
        require("matplotlib")
        from fulmar_benchmarks.inertia.report import write_report
    with work_bar("satellites") as progress:
        document = run_inertia(request, progress)
    finish(
        "inertia", document, out, lines_of=lines, as_json=as_json,
        write_report=(lambda: write_report(document, out)) if report else None,
    )  # fmt: skip
