"""What `fulmar train` does with a checked request: one training, a campaign, or one task after another."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import typer

from fulmar_bringup.console import log_line, print_json, print_result, write_line
from fulmar_cli.installation.extras import require
from fulmar_core.config.errors import FAILED, ConfigError

if TYPE_CHECKING:
    from training.continual_plan import ContinualPlan
    from training.jobs import Job
    from training.request import TrainingRequest


def learn_once(job: Job, *, resumes: bool, as_json: bool) -> None:
    """Train once, and evaluate in MuJoCo."""
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


def learn_campaign(job: Job, request: TrainingRequest, *, as_json: bool) -> None:
    """Train with several seeds, and compare them."""
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


def learn_tasks_in_turn(plan: ContinualPlan, *, as_json: bool) -> None:
    """Train at task after task, and print the success at each after every stage."""
    from training.continual import learn_tasks
    from training.progress import DistillationBar, LearningBar, Watcher
    from training.run_folder import learning_in

    def watch(task: str) -> Watcher:
        log_line(f"stage {plan.tasks.index(task) + 1} of {len(plan.tasks)}: {task}")
        return LearningBar()

    log_line(f"run folder: {plan.out}")
    with learning_in(plan.out), DistillationBar() as bar:
        try:
            plan = learn_tasks(plan, watch, bar)
        except KeyboardInterrupt:
            log_line(f"to resume: fulmar train --resume {plan.out}")
            raise
    result = plan.record | {"run": str(plan.out)}
    print_result(result, lambda result: write_line(matrix_text(result)), as_json=as_json)


def matrix_text(result: dict[str, Any]) -> str:
    """Success in MuJoCo at each task after each stage, as a table, and what to do next."""
    tasks, stages = result["tasks"], result["stages"]
    width = max(map(len, tasks))
    head = "  ".join([*tasks, "episodes"])
    lines = ["success in MuJoCo", f"{'after':{width}}  {head}"]
    for stage in stages:
        cells = _cells(stage["mujoco"], tasks)
        lines.append(f"{stage['task']:{width}}  {cells}  {stage['episodes']:8}")
    alone = {stage["task"]: stage["training"]["mujoco"] for stage in stages}
    lines.append(f"{'(alone)':{width}}  {_cells(alone, tasks)}")
    run = result["run"]
    lines.append(f"a bundle of each: fulmar export {run}/{tasks[0]} --out runs/bundles/{tasks[0]}")
    lines.append(f"a further task: fulmar train --resume {run} --continue-with TASK")
    return "\n".join(lines)


def _cells(rates: dict[str, float], tasks: list[str]) -> str:
    return "  ".join(f"{f'{rates[task]:.3f}' if task in rates else '':>{len(task)}}" for task in tasks)
