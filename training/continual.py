"""Continual learning: task after task is learned, and one policy keeps all of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from training.continual_plan import ALONE_FOLDER, ContinualPlan
from training.distillation import distil
from training.evaluator import Check, evaluate_in_mujoco, held_out_evaluator
from training.jobs import Job, run_job
from training.network import DeployedNetwork, load_network, save_network
from training.progress import Watcher
from training.run_folder import (
    NETWORK_FILE,
    SETTINGS_FILE,
    learning_in,
    read_run_record,
    write_run_record,
)
from training.settings import write_training_settings
from training.train import check_seed


def learn_tasks(
    plan: ContinualPlan, watcher_of: Callable[[str], Watcher], advance: Callable[[float], None]
) -> ContinualPlan:
    """Learn the tasks of a plan that are not learned yet.

    A stage trains a network at one task alone, in `alone/<task>` of the run folder, and then teaches one policy what
    the networks of all tasks so far know (`training.distillation`). The part of each task in that policy is a run
    folder of the task's name, which `fulmar export` reads.

    Args:
        plan: The plan; its finished stages are not repeated, and a training that was broken off is resumed.
        watcher_of: Makes what receives the progress of the training at a task.
        advance: Called with the share of a distillation that is done [-].

    Returns:
        The plan with all stages.

    Raises:
        ConfigError: The seed is reserved, or a run folder within cannot be read.
        KeyboardInterrupt: The user ended it.
    """
    check_seed(plan.seed)
    plan.write()
    for number in range(len(plan.stages), len(plan.tasks)):
        task = plan.tasks[number]
        learned = _learn_alone(plan, task, watcher_of(task))
        began, cpu_began = time.monotonic(), time.process_time()
        networks = _common(plan, plan.tasks[: number + 1], advance)
        taken = {
            "wall_s": round(time.monotonic() - began, 1),
            "cpu_s": round(time.process_time() - cpu_began, 1),
        }
        mujoco = {name: _evaluated(plan, name, network, networks) for name, network in networks.items()}
        stage = {
            "task": task, "training": _summary(learned), "distillation": taken,
            "episodes": plan.episodes, "mujoco": mujoco,
        }  # fmt: skip
        plan = plan.with_stage(stage)
    return plan


def _learn_alone(plan: ContinualPlan, task: str, watcher: Watcher) -> dict[str, Any]:
    """The record of the training at one task; an unfinished one goes on from its checkpoint."""
    job = Job(
        name=task, robot=plan.robot, task=task, seed=plan.seed, settings=plan.settings_of(task),
        out=plan.out / ALONE_FOLDER / task, time_limit_s=plan.time_limit_s, updates=plan.updates,
        episodes=plan.episodes, command=plan.command, git_revision=plan.git_revision,
    )  # fmt: skip
    with learning_in(job.out):
        return run_job(job, watcher)


def _common(
    plan: ContinualPlan, tasks: tuple[str, ...], advance: Callable[[float], None]
) -> dict[str, DeployedNetwork]:
    """The network of each task within one policy; of a single task its own."""
    networks = {}
    for name in tasks:
        network = load_network(plan.out / ALONE_FOLDER / name / NETWORK_FILE)
        assert isinstance(network, DeployedNetwork)  # by the algorithms that a plan allows
        networks[name] = network
    if len(tasks) == 1:
        return networks
    settings = [plan.settings_of(name) for name in tasks]
    return distil(
        networks,
        plan.learner,
        {name: load_task(name) for name in tasks},
        {name: load_scenario(each.scenario) for name, each in zip(tasks, settings, strict=True)},
        hidden=max((network.plan.hidden for network in networks.values()), key=sum),
        seed=plan.seed,
        advance=advance,
    )


def _evaluated(
    plan: ContinualPlan, task: str, network: DeployedNetwork, networks: Mapping[str, DeployedNetwork]
) -> float:
    """Write the run folder of a task's network, and return its success in MuJoCo [-]."""
    record, folder = read_run_record(plan.out / ALONE_FOLDER / task), plan.out / task
    settings = plan.settings_of(task)
    folder.mkdir(exist_ok=True)
    write_training_settings(settings, folder / SETTINGS_FILE)
    save_network(network, folder / NETWORK_FILE)
    if len(networks) == 1:  # it is the network that was evaluated already
        write_run_record(folder, record)
        return float(record["mujoco"]["success_rate"])
    evaluator = held_out_evaluator(plan.learner, load_task(task), load_scenario(settings.scenario))
    check = Check(record["wall_s"], record["steps"], *evaluator(network))
    del record["mujoco"]  # of the network that was trained alone
    write_run_record(folder, record | {"best": asdict(check), "learned_tasks": list(networks)})
    return float(evaluate_in_mujoco(folder, episodes=plan.episodes)["success_rate"])


def _summary(record: dict[str, Any]) -> dict[str, Any]:
    return {key: record[key] for key in ("updates", "steps", "wall_s", "cpu_s")} | {
        "held_out": record["best"]["success_rate"],
        "mujoco": record["mujoco"]["success_rate"],
    }
