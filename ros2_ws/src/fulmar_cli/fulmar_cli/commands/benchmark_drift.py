"""`fulmar benchmark drift`: our controllers under DRIFT's disturbances, beside its own."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from fulmar_cli.commands.arguments import (
    CORES,
    JobsOption,
    JsonOption,
    PolicyOption,
    SeedOption,
    invoked_command,
    option,
)
from fulmar_cli.commands.benchmark_campaign import (
    OUT_HELP,
    CheckOption,
    FreshOption,
    ReportOption,
    run_campaign,
)
from fulmar_cli.commands.values import read_names
from fulmar_cli.installation.extras import require
from fulmar_core.config.errors import UnknownNameError
from fulmar_core.config.seeds import EVALUATION_SEED

if TYPE_CHECKING:
    from fulmar_benchmarks.results import PairResult


def drift(
    through: Annotated[
        str, option("batch|mujoco|ros", "ros: the deployed nodes over DDS, in lock step.")
    ] = "ros",
    controllers: Annotated[
        str, option("K,...", "Out of policy and the classical controllers.")
    ] = "policy,lqr",
    rows: Annotated[
        str | None, option("R,...", "Names of conditions and paths; all twelve by default.")
    ] = None,
    episodes: Annotated[
        int, option("N", "Trajectories of each condition; paths have at most 4.", min=1)
    ] = 256,
    seed: SeedOption = EVALUATION_SEED,
    policy: PolicyOption = None,
    tracking_policy: Annotated[
        Path | None, option("DIR", "Policy bundle for the paths; the shipped one by default.")
    ] = None,
    out: Annotated[Path, option("DIR", OUT_HELP, "--out", "--output")] = Path("runs/benchmark/drift"),
    jobs: JobsOption = CORES,
    fresh: FreshOption = False,
    report: ReportOption = True,
    check: CheckOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run the experiment of thesis Tables 3.5 and 3.6, and print both side by side.

    Nine conditions of 256 trajectories from 3 to 4 m away, 250 steps of 0.2 s each, and three paths at 0.2 m/s; in
    MuJoCo, through the deployed nodes. DIR keeps results for the same code, configuration and controller, so an
    interrupted benchmark continues where it stopped. DIR/index.html is the report, DIR/drift.json the figures.

    Try:

    fulmar benchmark drift --rows ideal,torque --controllers lqr --through mujoco
    """
    from fulmar_benchmarks.drift.campaign import run_drift
    from fulmar_benchmarks.drift.conditions import ROWS
    from fulmar_benchmarks.drift.document import Request
    from fulmar_benchmarks.drift.tables import print_tables
    from fulmar_evaluation.evaluation import WAYS
    from policy_server.controllers import CONTROLLERS

    if through not in WAYS:
        raise UnknownNameError("way", through, WAYS)
    known = [name for name in CONTROLLERS if name != "classical"]
    names = read_names(controllers, "controller", known, as_given=True)
    require(*(["onnxruntime"] if "policy" in names else []), *([] if through == "batch" else ["mujoco"]))
    request = Request(
        rows=ROWS if rows is None else read_names(rows, "row", ROWS), controllers=names, through=through,
        episodes=episodes, seed=seed, folder=out, policy=policy, tracking_policy=tracking_policy,
        jobs=jobs, fresh=fresh, command=invoked_command(),
    )  # fmt: skip
    if report:
        require("matplotlib")
        from fulmar_benchmarks.drift.report import write_report
    run_campaign(
        run_drift, request, name_of=lambda unit: f"{unit.row}, {unit.controller}", figure_of=_main_figure,
        print_tables=print_tables, write_report=write_report if report else None, check=check, as_json=as_json,
    )  # fmt: skip


def _main_figure(result: PairResult) -> str:
    figures = result.figures
    if "PT5_percent" in figures:
        return f"PT5 {figures['PT5_percent'].mean():.1f} %, OT5 {figures['OT5_percent'].mean():.1f} %"
    return f"velocity error {figures['velocity_error_m_s'].mean():.4f} m/s"
