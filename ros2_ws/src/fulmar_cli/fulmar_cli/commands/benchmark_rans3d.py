"""`fulmar benchmark rans3d`: our controllers of bodies in space at RANS' 3-D tasks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from fulmar_cli.commands.arguments import CORES, JobsOption, JsonOption, SeedOption, invoked_command, option
from fulmar_cli.commands.benchmark_campaign import (
    OUT_HELP,
    CheckOption,
    FreshOption,
    ReportOption,
    run_campaign,
)
from fulmar_cli.commands.values import read_names
from fulmar_cli.installation.extras import require
from fulmar_core.config.seeds import EVALUATION_SEED

if TYPE_CHECKING:
    from fulmar_benchmarks.unit import Unit


def rans3d(
    robots: Annotated[str, option("R,...", "Out of spacecraft_16 and int_ball2, or all.")] = "all",
    tasks: Annotated[str, option("T,...", "Out of the five tasks that end in _3d, or all.")] = "all",
    controllers: Annotated[str, option("K,...", "Out of lqr, pd and policy, or all.")] = "all",
    scenarios: Annotated[str, option("S,...", "Out of nominal and randomised, or all.")] = "all",
    parts: Annotated[
        str,
        option(
            "P,...",
            "Out of tasks, dead (thrusters), integrator and throughput, or all.",
        ),
    ] = "all",
    policies: Annotated[
        Path | None, option("DIR", "Folder of bundles named ROBOT_TASK; the shipped ones by default.")
    ] = None,
    episodes: Annotated[int, option("N", "Of each controller at each task and scenario.", min=1)] = 256,
    seed: SeedOption = EVALUATION_SEED,
    tumble_s: Annotated[
        float, option("S", "Length of the tumble by which the integrator is measured [s].", min=1.0)
    ] = 3600.0,
    worlds: Annotated[int, option("N", "Worlds of the batch whose pace is measured.", min=1)] = 4096,
    seconds: Annotated[float, option("S", "Time of each measurement of the pace [s].", min=0.05)] = 1.0,
    out: Annotated[Path, option("DIR", OUT_HELP)] = Path("runs/benchmark/rans3d"),
    jobs: JobsOption = CORES,
    fresh: FreshOption = False,
    report: ReportOption = True,
    check: CheckOption = False,
    as_json: JsonOption = False,
) -> None:
    """Evaluate the controllers of bodies in space at the 3-D tasks of RANS, in MuJoCo.

    Beside success and errors of spacecraft_16 and int_ball2, nominal and randomised: thrusters that are dead, what the
    integrator keeps of a torque-free tumble, and the pace of the batch beside MuJoCo's rollout. A bundle that does not
    exist leaves its cells empty and says how to make it. int_ball2 starts up to 2 m away and has 60 s. DIR keeps
    results for the same code, configuration and controller, so an interrupted benchmark continues where it stopped.
    DIR/index.html is the report, DIR/rans3d.json the figures.

    Try:

    fulmar benchmark rans3d --robots spacecraft_16 --tasks go_to_pose_3d --parts tasks,integrator
    """
    from fulmar_benchmarks.cells import display_name
    from fulmar_benchmarks.rans3d.campaign import run_rans3d
    from fulmar_benchmarks.rans3d.document import PARTS, Request
    from fulmar_benchmarks.rans3d.tables import print_tables
    from fulmar_benchmarks.rans3d.targets import CONTROLLERS, ROBOTS, SCENARIOS, TASKS

    names = read_names(controllers, "controller", CONTROLLERS)
    request = Request(
        folder=out, episodes=episodes, seed=seed, parts=read_names(parts, "part", PARTS),
        robots=read_names(robots, "robot", ROBOTS), tasks=read_names(tasks, "task", TASKS), controllers=names,
        scenarios=read_names(scenarios, "scenario", SCENARIOS), policies=policies,
        jobs=jobs, fresh=fresh, tumble_s=tumble_s, worlds=worlds, seconds=seconds,
        command=invoked_command(),
    )  # fmt: skip
    require("mujoco", *(["onnxruntime"] if "policy" in names else []))
    if report:
        require("matplotlib")
        from fulmar_benchmarks.rans3d.report import write_report

    def name_of(unit: Unit) -> str:
        plan = unit.trial.plan
        return f"{display_name(plan.robot)}, {display_name(plan.task)}, {plan.controller}, {plan.scenario}"

    run_campaign(
        run_rans3d, request, name_of=name_of, print_tables=print_tables, check=check, as_json=as_json,
        figure_of=lambda result: f"success {result.succeeded.mean():.3f}",
        write_report=write_report if report else None,
    )  # fmt: skip
