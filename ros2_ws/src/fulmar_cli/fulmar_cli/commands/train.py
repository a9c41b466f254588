"""`fulmar train`: learn a policy in the core's batch, once or with several seeds."""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fulmar_bringup.console import console, output, print_json
from fulmar_cli.commands.arguments import CalibrationOption, JsonOption, SeedOption
from fulmar_cli.extras import require
from fulmar_core.errors import FAILED, ConfigError
from fulmar_core.robot import use_calibration

if TYPE_CHECKING:
    from training.executors import Executor
    from training.jobs import Job


def train(
    robot: Annotated[
        str | None, typer.Argument(metavar="ROBOT", help="A name from `fulmar list robots`.")
    ] = None,
    task: Annotated[
        str | None, typer.Argument(metavar="TASK", help="A name from `fulmar list tasks`.")
    ] = None,
    seed: SeedOption = 1,
    seeds: Annotated[
        int, typer.Option(metavar="N", min=1, help="A campaign of this many seeds, beginning with --seed.")
    ] = 1,
    time_limit: Annotated[
        float | None,
        typer.Option(metavar="S", min=1.0, help="Wall-clock seconds of learning; the settings' by default."),
    ] = None,
    updates: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="End after this many updates instead.")
    ] = None,
    stop_at_success: Annotated[
        float | None,
        typer.Option(metavar="RATE", min=0.0, max=1.0, help="End early after two checks with this success."),
    ] = None,
    settings: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="A file of configs/training, or a path; by robot and task by default."
        ),
    ] = None,
    control_hz: Annotated[
        float | None,
        typer.Option(
            metavar="HZ", help="Rate of the commands; the settings', or the robot's own by default."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Run folder; runs/train/<time>... by default.")
    ] = None,
    episodes: Annotated[
        int, typer.Option(metavar="N", min=1, help="Episodes of the closing judgement in MuJoCo.")
    ] = 256,
    calibration: CalibrationOption = None,
    resume: Annotated[
        Path | None, typer.Option(metavar="RUN", help="Go on with this run, exactly where it was.")
    ] = None,
    executor: Annotated[
        str, typer.Option(metavar="E", help="Who runs a campaign: local (one run a core) or ray (a cluster).")
    ] = "local",
    address: Annotated[
        str | None, typer.Option(metavar="A", help="Of the Ray cluster; RAY_ADDRESS or a new one by default.")
    ] = None,
    wandb: Annotated[
        bool, typer.Option("--wandb", help="Send curves to Weights & Biases too, project 'fulmar'.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Learn a policy, then judge it in MuJoCo, where it was not trained.

    Settings come from configs/training: <robot>_<task>.yaml if there is one, else the one of the robot's family. The
    run folder holds the best weights, the learning curve, TensorBoard logs and a checkpoint; Ctrl-C finishes it.
    `fulmar export` makes a policy bundle of it.

    Try:

    fulmar train floating_platform go_to_pose --seed 3 --out runs/train/mine

    fulmar train turtlebot2 go_to_position --seeds 5

    fulmar train --resume runs/train/mine --time-limit 300

    fulmar train floating_platform go_to_pose --control-hz 50 --updates 20
    """
    from training.jobs import Job
    from training.train import check_seed

    if wandb:
        require("wandb")
    if executor not in ("local", "ray"):
        raise ConfigError(f"--executor {executor}: must be local or ray.")
    if resume and (robot or task or settings or out or seed != 1):
        raise ConfigError(
            "--resume goes on with what the run began with; leave ROBOT, TASK, --seed, --settings and --out out."
        )
    if stop_at_success == 0.0:
        raise ConfigError("--stop-at-success 0 would stop at once; it must be greater than 0, and at most 1.")
    if control_hz is not None and resume:
        raise ConfigError("--resume goes on at the rate that the run began with; leave --control-hz out.")
    if calibration is not None:
        if resume:
            raise ConfigError(
                "--resume goes on with the calibration that the run began with; leave --calibration out."
            )
        if executor == "ray":
            raise ConfigError(
                "--calibration is a file of this machine; --executor ray does not carry it. Use local."
            )
        use_calibration(calibration, robot or "")
    if (executor == "ray" or address) and seeds == 1:
        raise ConfigError(
            "--executor ray and --address are for campaigns: give --seeds N, or leave them out."
        )
    job = Job(
        name="",
        **(_resumed(resume) if resume else _asked(robot, task, seed, settings, out, campaign=seeds > 1)),
        episodes=episodes,
        wandb="fulmar" if wandb else "",
        command="fulmar " + " ".join(sys.argv[1:]),
        git_revision=_revision(),
    )
    if time_limit is not None or updates is not None:
        job = replace(job, time_limit_s=time_limit, updates=updates)
        if resume:
            _remember_limits(job)
    if stop_at_success is not None:
        from training.settings import StopAtSuccess

        enough = StopAtSuccess(stop_at_success)
        job = replace(job, settings=replace(job.settings, stop_at_success=enough))
    if control_hz is not None:
        job = _commanded_at(job, control_hz)
    job = replace(job, name=f"{job.robot}_{job.task}_{job.seed}")
    if resume and seeds > 1:
        raise ConfigError(
            "--resume and --seeds exclude one another: resume the runs of a campaign one by one."
        )
    for each in range(job.seed, job.seed + seeds):
        check_seed(each)  # all of them, before anything is made
    if seeds == 1:
        _one(job, resumes=resume is not None, as_json=as_json)
    else:
        _campaign(job, seeds, _executor(executor, address), as_json=as_json)


def _remember_limits(job: Job) -> None:
    """For who resumes the run once more."""
    from training.run_folder import read_start, write_start

    limits = {"time_limit_s": job.time_limit_s, "updates": job.updates}
    write_start(job.out, read_start(job.out) | limits)


def _commanded_at(job: Job, control_hz: float) -> Job:
    from fulmar_core.robot import load_robot

    settings = replace(job.settings, control_hz=control_hz)
    settings.learner_of(load_robot(job.robot))  # whatever is wrong is said before anything starts
    return replace(job, settings=settings)


def _asked(
    robot: str | None, task: str | None, seed: int, settings: str | None, out: Path | None, *, campaign: bool
) -> dict[str, Any]:
    from fulmar_core.robot import load_robot
    from fulmar_core.tasks import load_task
    from training.settings import load_training_settings

    if robot is None or task is None:
        raise ConfigError("ROBOT and TASK are needed, or --resume RUN. Try `fulmar train --help`.")
    last = "seeds" if campaign else str(seed)
    out = out or Path("runs") / "train" / f"{time.strftime('%Y%m%d_%H%M%S')}_{robot}_{task}_{last}"
    if out.is_dir() and any(out.iterdir()):
        raise ConfigError(f"{out} is not empty; nothing recorded is overwritten. Give --out another folder.")
    return {
        "robot": robot,
        "task": task,
        "seed": seed,
        "settings": load_training_settings(load_robot(robot), load_task(task), settings),
        "out": out,
    }


def _resumed(run: Path) -> dict[str, Any]:
    from fulmar_core.robot import load_robot
    from fulmar_core.tasks import load_task
    from training.run_folder import CALIBRATION_FILE, SETTINGS_FILE, read_start
    from training.settings import load_training_settings

    start = read_start(run)
    if (run / CALIBRATION_FILE).is_file():
        use_calibration(run / CALIBRATION_FILE, start["robot"])
    robot, task = load_robot(start["robot"]), load_task(start["task"])
    return start | {"settings": load_training_settings(robot, task, str(run / SETTINGS_FILE)), "out": run}


def _revision() -> str:
    from fulmar_core.provenance import git_revision

    return git_revision()


def _one(job: Job, *, resumes: bool, as_json: bool) -> None:
    from training.evaluator import judge_in_mujoco
    from training.jobs import learn
    from training.progress import LearningBar
    from training.run_folder import START_FILE
    from training.run_lock import learning_in

    with learning_in(job.out):
        if not resumes and (job.out / START_FILE).exists():  # since we looked
            raise ConfigError(f"{job.out}: another training began there. Give --out another folder.")
        console.print(_when_it_ends_early(job), markup=False, soft_wrap=True)
        try:
            record = learn(job, LearningBar(job.out))
        except KeyboardInterrupt:
            _tell_how_to_go_on(job.out)
            raise
    parts = [record, record.get("specialist", {"steps": 0, "wall_s": 0.0})]
    steps, wall_s = (sum(part[key] for part in parts) for key in ("steps", "wall_s"))
    console.print(f"learned from {steps:,} steps in {wall_s:.0f} s; judging in MuJoCo")
    figures = judge_in_mujoco(job.out, episodes=job.episodes)
    if as_json:
        print_json({"run": str(job.out), "steps": steps, "wall_s": wall_s, "mujoco": figures})
        return
    output.print(
        f"success {figures['success_rate']:.3f} of {job.episodes} episodes in MuJoCo; run folder {job.out}\n"
        f"next: fulmar export {job.out} --out DIR",
        markup=False,
    )


def _when_it_ends_early(job: Job) -> str:
    """One line on `--stop-at-success`: what was asked for, or what to ask for."""
    enough = job.settings.stop_at_success
    if enough is None:
        return "learns for all of its time; to end it once the task is learned: --stop-at-success 0.99"
    return f"ends early after {enough.checks} checks in a row with success {enough.rate:g} or more"


def _tell_how_to_go_on(run: Path) -> None:
    from training.run_folder import CHECKPOINT_FILE, NETWORK_FILE, RUN_FILE

    if (run / CHECKPOINT_FILE).is_file():
        console.print(f"go on with it: fulmar train --resume {run}", markup=False, soft_wrap=True)
    if (run / RUN_FILE).is_file() and (run / NETWORK_FILE).is_file():
        console.print(f"its best so far: fulmar export {run} --out DIR", markup=False, soft_wrap=True)


def _executor(name: str, address: str | None) -> Executor:
    if name == "ray":
        require("ray")
        from training.ray_executor import RayExecutor

        return RayExecutor(address)
    from training.executors import LocalExecutor

    return LocalExecutor()


def _campaign(job: Job, seeds: int, executor: Executor, *, as_json: bool) -> None:
    from training.campaign import run_campaign
    from training.job_bars import JobBars

    jobs = [
        replace(job, name=f"seed {seed}", seed=seed, out=job.out / f"seed_{seed}")
        for seed in range(job.seed, job.seed + seeds)
    ]
    with JobBars(jobs) as bars:
        told = run_campaign(jobs, executor, job.out, bars)
    if as_json:
        print_json(told)
    else:
        _print_campaign(told, job.out)
    if told["failed"]:
        raise typer.Exit(FAILED)


def _print_campaign(told: dict[str, Any], out: Path) -> None:
    output.print(f"{'seed':>6}  {'held out':>8}  {'MuJoCo':>7}  {'steps':>12}", markup=False)
    for line in told["seeds"]:
        if "error" in line:
            output.print(f"{line['seed']:>6}  failed: {line['error']}", markup=False)
            continue
        judged = f"{line['success_mujoco']:>7.3f}" if line["success_mujoco"] is not None else f"{'-':>7}"
        output.print(
            f"{line['seed']:>6}  {line['success_held_out']:>8.3f}  {judged}  {line['steps']:>12,}",
            markup=False,
        )
    if told["best_run"] is None:
        output.print(f"no run of {out} succeeded", markup=False)
        return
    output.print(
        f"success {told['success_mean']:.3f} ± {told['success_std']:.3f}; best: seed {told['best_seed']}\n"
        f"next: fulmar export {told['best_run']} --out DIR",
        markup=False,
    )
