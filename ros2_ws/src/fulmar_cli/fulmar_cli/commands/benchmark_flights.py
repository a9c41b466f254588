"""`fulmar benchmark flights`: flights through nodes beside those of the batch."""

from __future__ import annotations

from typing import Annotated

import typer

from fulmar_bringup.console import print_result, write_line
from fulmar_bringup.progress import work_bar
from fulmar_cli.commands.arguments import (
    CORES,
    ControlHzOption,
    JobsOption,
    JsonOption,
    PolicyOption,
    ScenarioOption,
    SeedOption,
    option,
)
from fulmar_core.config.errors import FAILED
from fulmar_core.config.seeds import EVALUATION_SEED


def flights(
    robot: Annotated[str, option("NAME", "An aircraft.")] = "airship_v7",
    task: Annotated[str, option("T", "fly_hold, or fly_a to fly_f.")] = "fly_hold",
    controller: Annotated[str, option("C", "lqi, lqr, mppi, pid or policy.")] = "policy",
    policy: PolicyOption = None,
    episodes: Annotated[int, option("N", "Flights in lock step.", min=1)] = 64,
    real_time: Annotated[int, option("N", "Flights in real time.", min=0)] = 4,
    episode_s: Annotated[float, option("S", "Length of each [s].", min=5.0)] = 60.0,
    seed: SeedOption = EVALUATION_SEED,
    scenario: ScenarioOption = "nominal",
    control_hz: ControlHzOption = None,
    jobs: JobsOption = CORES,
    as_json: JsonOption = False,
) -> None:
    """Fly an aircraft through ROS nodes, in lock step and in real time, beside the same flights in the batch.

    The flights in lock step are those of the batch, by seed and number; each in real time has a twin in the batch that
    begins alike. A policy runs at the rate that it was trained at. Altitude RMSE is over all flights of a way that
    survive, other figures are their medians. The exit code is 1 unless the altitude's RMSE differs by 0.02 m at most
    and the 99th percentile of the control period's error stays below 3 ms in each real-time flight; nothing else should
    run meanwhile.

    Try:

    fulmar benchmark flights --controller lqi --episodes 8 --episode-s 20
    """
    from fulmar_benchmarks.falcon.live import LiveRequest, fly_live, print_live
    from fulmar_cli.installation.extras import check_plan
    from fulmar_core.robots.robot_file import load_robot
    from fulmar_core.tasks import load_task
    from fulmar_evaluation.trial_plan import plan_trial
    from policy_server.controllers import usual_hz

    hz = control_hz or usual_hz(controller, load_robot(robot), load_task(task), policy)
    trial = plan_trial(
        robot=robot, task=task, controller=controller, policy=policy, through="ros", episodes=episodes,
        seed=seed, scenario=scenario, control_hz=hz, jobs=jobs, episode_s=episode_s, steps=None,
        worlds=None, bounds=None,
    )  # fmt: skip
    check_plan(trial.plan, through="ros")
    with work_bar("flights") as progress:
        document = fly_live(LiveRequest(trial, real_time), progress)
    print_result(document, lambda found: print_live(found, write_line), as_json=as_json)
    if not document["passed"]:
        raise typer.Exit(FAILED)
