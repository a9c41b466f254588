"""`fulmar benchmark roboran`: our policies beside the thesis' Table 4.7."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from fulmar_cli.commands.arguments import (
    CORES,
    JobsOption,
    JsonOption,
    ScenarioOption,
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
from fulmar_core.config.seeds import EVALUATION_SEED


def roboran(
    robots: Annotated[
        str | None, option("R,...", "Names with commas between, or all; the thesis' three by default.")
    ] = None,
    tasks: Annotated[
        str | None, option("T,...", "Names with commas between, or all; five by default.")
    ] = None,
    through: Annotated[str, option("W,...", "Out of batch, mujoco and ros, or all.")] = "batch,mujoco",
    controllers: Annotated[
        str, option("K,...", "policy: the shipped bundles. classical: the laws of the families.")
    ] = "policy",
    policies: Annotated[
        Path | None, option("DIR", "Folder of bundles named ROBOT_TASK; the shipped ones by default.")
    ] = None,
    episodes: Annotated[
        int | None, option("N", "In every way; 4,096, 256 and 16 through ros by default.", min=1)
    ] = None,
    seed: SeedOption = EVALUATION_SEED,
    scenario: ScenarioOption = "nominal",
    out: Annotated[Path, option("DIR", OUT_HELP)] = Path("runs/benchmark/roboran"),
    jobs: JobsOption = CORES,
    fresh: FreshOption = False,
    report: ReportOption = True,
    check: CheckOption = False,
    as_json: JsonOption = False,
) -> None:
    """Evaluate the shipped policies as thesis Table 4.7 does, and print both side by side.

    Success is evaluated on true states over the closing window, in 4,096 episodes of the core's batch and 256 in
    MuJoCo. DIR keeps results for the same code, configuration and controller, so an interrupted benchmark continues
    where it stopped. DIR/index.html is the report, DIR/roboran.json the figures.

    Try:

    fulmar benchmark roboran --robots turtlebot2 --tasks go_to_pose --controllers policy,classical
    """
    from fulmar_benchmarks.cells import display_name
    from fulmar_benchmarks.pairs import KINDS
    from fulmar_benchmarks.roboran.campaign import EPISODES, Request, run_benchmark
    from fulmar_benchmarks.roboran.cells import print_tables
    from fulmar_benchmarks.roboran.targets import ROBOTS, TASKS
    from fulmar_benchmarks.unit import Unit
    from fulmar_core.config.paths import config_names
    from fulmar_core.worlds.scenario import load_scenario
    from policy_server.controllers import controller_entry

    load_scenario(scenario)
    ways = read_names(through, "way", tuple(EPISODES))
    kinds = read_names(controllers, "kind of controller", KINDS)
    require(*(module for kind in kinds for module in controller_entry(kind).needs))
    require(*(["mujoco"] if {"mujoco", "ros"} & set(ways) else []), *(["matplotlib"] if report else []))
    request = Request(
        robots=ROBOTS if robots is None else read_names(robots, "robot", config_names("robots")),
        tasks=TASKS if tasks is None else read_names(tasks, "task", config_names("tasks")),
        kinds=kinds, episodes={way: episodes or EPISODES[way] for way in ways}, seed=seed, scenario=scenario,
        folder=out, policies=policies, jobs=jobs, fresh=fresh,
        command=invoked_command(),
    )  # fmt: skip

    def name_of(unit: Unit) -> str:
        plan = unit.trial.plan
        return f"{display_name(plan.robot)}, {display_name(plan.task).lower()}, {plan.controller}, {unit.trial.through}"

    if report:
        from fulmar_benchmarks.roboran.report import write_report
    run_campaign(
        run_benchmark, request, name_of=name_of, print_tables=print_tables, check=check, as_json=as_json,
        figure_of=lambda result: f"success {result.succeeded.mean():.3f}",
        write_report=write_report if report else None,
    )  # fmt: skip
