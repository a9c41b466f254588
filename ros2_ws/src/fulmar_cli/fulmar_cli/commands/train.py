"""`fulmar train`: learn a policy in the core's batch, with one seed or several."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from fulmar_cli.commands.arguments import (
    CalibrationOption,
    JsonOption,
    RayOption,
    SeedOption,
    argument,
    flag,
    invoked_command,
    option,
)
from fulmar_cli.commands.train_runs import learn_campaign, learn_once, learn_tasks_in_turn
from fulmar_cli.installation.extras import require
from fulmar_core.config.errors import ConfigError


def train(
    robot: Annotated[str | None, argument("ROBOT", "A name from `fulmar list robots`.")] = None,
    task: Annotated[str | None, argument("TASK", "A name from `fulmar list tasks`.")] = None,
    seed: SeedOption = 1,
    seeds: Annotated[int, option("N", "A campaign of this many seeds, beginning with --seed.", min=1)] = 1,
    time_limit: Annotated[
        float | None, option("S", "Wall-clock seconds of learning; the settings' by default.", min=1.0)
    ] = None,
    updates: Annotated[int | None, option("N", "End after this many updates instead.", min=1)] = None,
    stop_at_success: Annotated[
        float | None, option("RATE", "End early after two checks with this success.", min=0.0, max=1.0)
    ] = None,
    settings: Annotated[
        str | None, option("NAME", "A file of configs/training, or a path; by robot and task by default.")
    ] = None,
    control_hz: Annotated[
        float | None, option("HZ", "Command rate; the settings', or the robot's own by default.")
    ] = None,
    out: Annotated[Path | None, option("DIR", "Run folder; runs/train/<time>... by default.")] = None,
    episodes: Annotated[int, option("N", "Episodes of the final evaluation in MuJoCo.", min=1)] = 256,
    calibration: CalibrationOption = None,
    resume: Annotated[Path | None, option("RUN", "Resume this run exactly where it stopped.")] = None,
    continue_with: Annotated[
        str | None, option("TASK,...", "Tasks that the same network then learns, one after another.")
    ] = None,
    executor: Annotated[
        str, option("E", "Where a campaign runs: local (one run a core) or ray (a cluster).")
    ] = "local",
    address: Annotated[
        str | None, option("A", "Address of the Ray cluster; RAY_ADDRESS or a new one by default.")
    ] = None,
    ray: RayOption = None,
    wandb: Annotated[bool, flag("--wandb", "Send curves to Weights & Biases too, project 'fulmar'.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Learn a policy, then evaluate it in MuJoCo, where it was not trained.

    Settings come from configs/training: <robot>_<task>.yaml if there is one, else those of the robot's family. The
    run folder holds the best weights, the learning curve, TensorBoard logs and a checkpoint; Ctrl-C finishes it.
    `fulmar export` makes a policy bundle of it.

    Try:

    fulmar train floating_platform go_to_pose --seed 3 --out runs/train/mine

    fulmar train turtlebot2 go_to_position --seeds 5

    fulmar train --resume runs/train/mine --time-limit 300

    fulmar train floating_platform go_to_pose --control-hz 50 --updates 20

    fulmar train floating_platform go_to_position --continue-with go_to_pose,track_velocities
    """
    from training.continual_plan import continual_plan, is_continual
    from training.request import TrainingRequest, job_of

    if wandb:
        require("wandb")
    if ray and address:
        raise ConfigError("--ray and --address both name a cluster: give one of them.")
    request = TrainingRequest(
        robot, task, seed, seeds, time_limit, updates, stop_at_success, settings, control_hz, out, episodes,
        calibration, resume, "ray" if ray else executor, ray or address, wandb, invoked_command(),
    )  # fmt: skip
    if continue_with is not None or is_continual(resume):
        further = [task.strip() for task in (continue_with or "").split(",") if task.strip()]
        learn_tasks_in_turn(continual_plan(request, further), as_json=as_json)
        return
    job = job_of(request)
    if seeds == 1:
        learn_once(job, resumes=resume is not None, as_json=as_json)
    else:
        learn_campaign(job, request, as_json=as_json)
