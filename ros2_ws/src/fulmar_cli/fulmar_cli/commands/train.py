"""`fulmar train`: learn a policy in the core's batch, with one seed or several."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fulmar_bringup.console import log_line, print_json, print_result, write_line
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
from fulmar_cli.installation.extras import require
from fulmar_core.config.errors import FAILED, ConfigError

if TYPE_CHECKING:
    from training.jobs import Job
    from training.request import TrainingRequest


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
    """
    from training.request import TrainingRequest, job_of

    if wandb:
        require("wandb")
    if ray and address:
        raise ConfigError("--ray and --address both name a cluster: give one of them.")
    request = TrainingRequest(
        robot, task, seed, seeds, time_limit, updates, stop_at_success, settings, control_hz, out, episodes,
        calibration, resume, "ray" if ray else executor, ray or address, wandb, invoked_command(),
    )  # fmt: skip
    job = job_of(request)
    if seeds == 1:
        _learn_once(job, resumes=resume is not None, as_json=as_json)
    else:
        _learn_campaign(job, request, as_json=as_json)


def _learn_once(job: Job, *, resumes: bool, as_json: bool) -> None:
    from training.advice import advice, usual_training
    from training.evaluator import evaluate_in_mujoco
    from training.jobs import learn
    from training.progress import LearningBar
    from training.run_folder import CHECKPOINT_FILE, NETWORK_FILE, RUN_FILE, START_FILE, learning_in

    enough = job.settings.stop_at_success
    with learning_in(job.out):
        if not resumes and (job.out / START_FILE).exists():  # made after the request was checked
            raise ConfigError(f"{job.out}: another training began there. Give --out another folder.")
        log_line(
            "learns for all of its time; to end it once the task is learned: --stop-at-success 0.99"
            if enough is None
            else f"ends early after {enough.checks} checks in a row with success {enough.rate:g} or more"
        )
        try:
            record = learn(job, LearningBar(job.out))
        except KeyboardInterrupt:
            if (job.out / CHECKPOINT_FILE).is_file():
                log_line(f"to resume: fulmar train --resume {job.out}")
            if (job.out / RUN_FILE).is_file() and (job.out / NETWORK_FILE).is_file():
                log_line(f"to export the best policy so far: fulmar export {job.out} --out DIR")
            raise
    parts = [record, record.get("fallback_policy", {"steps": 0, "wall_s": 0.0})]
    steps, wall_s = (sum(part[key] for part in parts) for key in ("steps", "wall_s"))
    log_line(f"learned from {steps:,} steps in {wall_s:.0f} s; evaluating in MuJoCo")
    figures = evaluate_in_mujoco(job.out, episodes=job.episodes)
    if as_json:
        usual = usual_training(job.robot, job.task)
        found = {"run": str(job.out), "steps": steps, "wall_s": wall_s, "mujoco": figures, "usual": usual}
        print_json(found)
        return
    rate, kind = figures["success_rate"], job.settings.algorithm.kind
    learned = {"robot": job.robot, "task": job.task, "steps": steps, "wall_s": wall_s, "algorithm": kind}
    write_line(f"success {rate:.3f} of {job.episodes} episodes in MuJoCo; run folder {job.out}")
    for line in advice(job.out, learned, rate):
        write_line(line)


def _learn_campaign(job: Job, request: TrainingRequest, *, as_json: bool) -> None:
    if request.executor == "ray":
        require("ray")
    from training.campaign import campaign_text, run_campaign
    from training.progress import JobBars
    from training.request import executor_of

    jobs = [
        replace(job, name=f"seed {seed}", seed=seed, out=job.out / f"seed_{seed}")
        for seed in range(job.seed, job.seed + request.seeds)
    ]
    with JobBars([each.name for each in jobs]) as bars:
        result = run_campaign(jobs, executor_of(request), job.out, bars)
    print_result(result, lambda result: write_line(campaign_text(result, job.out)), as_json=as_json)
    if result["failed"]:
        raise typer.Exit(FAILED)
