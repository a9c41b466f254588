"""Continual learning: one network learns task after task, and rehearses those that it has learned."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback, CallbackList
from stable_baselines3.common.logger import configure
from stable_baselines3.common.vec_env import VecNormalize

from fulmar_core.tasks import Task, load_task
from fulmar_core.worlds.scenario import load_scenario
from training.continual_plan import ContinualPlan
from training.evaluator import Check, Evaluator, evaluate_in_mujoco, held_out_evaluator
from training.joint_network import JointNetwork, network_of_task, normalised
from training.joint_worlds import JointInputs, JointWorlds
from training.learners import begin_near, build_learner, callbacks_of, first_action
from training.network import DeployedNetwork, save_network
from training.progress import Watcher
from training.run_folder import NETWORK_FILE, SETTINGS_FILE, TENSORBOARD_FOLDER, write_run_record
from training.session import Limits, RunHistory, RunIsOver, polite_interrupt
from training.settings import Ppo, write_training_settings
from training.train import check_seed, run_record
from training.vec_env import BatchVecEnv

STAGE_FILE = "stage_{}.pt"  # network of the tasks up to a stage, from 1 on
STAGE_SEEDS = 10_000_000  # between the seeds of two stages: no stage repeats the episodes of another


def learn_tasks(plan: ContinualPlan, watcher_of: Callable[[str], Watcher]) -> ContinualPlan:
    """Learn the tasks of a plan that are not learned yet, each until its limit.

    After each stage the run folder has its network, and for each learned task a folder of its name that
    `fulmar export` reads.

    Args:
        plan: The plan; its finished stages are not repeated.
        watcher_of: Makes what receives the progress of the stage of a task.

    Returns:
        The plan with all stages.

    Raises:
        ConfigError: The seed is reserved, or the network of a resumed run cannot be read.
        KeyboardInterrupt: The user ended it; finished stages stay, the one in progress is lost.
    """
    check_seed(plan.seed)
    torch.set_num_threads(1)  # as in `train`
    plan.begin()
    for number in range(len(plan.stages), len(plan.tasks)):
        plan = plan.with_stage(_learn_stage(plan, number, watcher_of(plan.tasks[number])))
    return plan


def _learn_stage(plan: ContinualPlan, number: int, watcher: Watcher) -> dict[str, Any]:
    """Learn the task of a number, write what was learned, and return the record of the stage."""
    before = JointNetwork.load(plan.out / STAGE_FILE.format(number)) if number else None
    tasks = {name: load_task(name) for name in plan.tasks[: number + 1]}
    newest = plan.tasks[number]
    parts = _worlds_of(plan, tasks, before)
    terms = _batch(parts[newest]).simulation.observer.names
    inputs = (before.inputs if before else JointInputs()).with_task(newest, terms)
    rehearsed = parts if plan.rehearsed else {newest: parts[newest]}
    learner = build_learner(plan.settings.algorithm, JointWorlds(rehearsed, inputs), seed=plan.seed)
    if before:
        before.begin(learner)
    else:
        begin_near(learner, first_action(plan.learner, tasks[newest]))
    learner.set_logger(configure(str(plan.out / TENSORBOARD_FOLDER / newest), ["tensorboard"]))
    scenario = load_scenario(plan.settings.scenario)
    evaluators = {name: held_out_evaluator(plan.learner, task, scenario) for name, task in tasks.items()}
    stage = Stage(plan, watcher, lambda: _evaluated(learner, inputs, parts, evaluators))
    stage.learn(learner)
    _write_run_folders(plan, tasks, stage)
    mujoco = {name: evaluate_in_mujoco(plan.out / name, episodes=plan.episodes) for name in tasks}
    assert stage.best is not None
    stage.best.joint.save(plan.out / STAGE_FILE.format(number + 1))
    return {
        "task": newest,
        "updates": stage.history.updates,
        "steps": learner.num_timesteps,
        "wall_s": round(stage.history.elapsed_s, 1),
        "cpu_s": round(stage.history.cpu_s, 1),
        "held_out": {name: round(found[0], 4) for name, found in stage.best.figures.items()},
        "mujoco": {name: figures["success_rate"] for name, figures in mujoco.items()},
    }


@dataclass(frozen=True)
class _Evaluated:
    """Networks of all tasks so far at a moment of a stage.

    Attributes:
        figures: Success rate and score of each task on held-out episodes.
        networks: Of each task, as a robot runs them.
        joint: What they are parts of.
    """

    figures: Mapping[str, tuple[float, float]]
    networks: Mapping[str, DeployedNetwork]
    joint: JointNetwork

    @property
    def score(self) -> float:
        """Mean score of the tasks."""
        return sum(score for _, score in self.figures.values()) / len(self.figures)

    @property
    def success(self) -> float:
        """Success rate of the worst task [-]."""
        return min(success for success, _ in self.figures.values())


def _evaluated(
    learner: BaseAlgorithm,
    inputs: JointInputs,
    parts: Mapping[str, VecNormalize],
    evaluators: Mapping[str, Evaluator],
) -> _Evaluated:
    networks = {name: network_of_task(learner, inputs, name, part) for name, part in parts.items()}
    figures = {name: evaluators[name](network) for name, network in networks.items()}
    return _Evaluated(figures, networks, JointNetwork.of(learner, inputs, parts))


class Stage(BaseCallback):
    """Callback that evaluates all tasks now and then between two updates, and ends the stage.

    Attributes:
        history: Time and updates so far.
        best: What was found at the evaluation with the best mean score.
    """

    best: _Evaluated | None = None

    def __init__(self, plan: ContinualPlan, watcher: Watcher, evaluate: Callable[[], _Evaluated]) -> None:
        super().__init__()
        self.history = RunHistory()
        self._settings, self._watcher, self._evaluate = plan.settings, watcher, evaluate
        time_s = plan.time_limit_s
        if time_s is None and plan.updates is None:
            time_s = plan.settings.time_limit_s
        self._limits = Limits(time_s, plan.updates)
        self._check_every = plan.settings.evaluate_every_s / (time_s or plan.settings.time_limit_s)
        self._next_check, self._first = self._check_every, True
        self._began, self._cpu_began = time.monotonic(), time.process_time()

    def learn(self, learner: BaseAlgorithm) -> None:
        """Let a learner learn until the stage is over; raises KeyboardInterrupt if the user asks for the end."""
        with polite_interrupt() as interrupt:
            self._asked_to_stop = interrupt.is_set
            try:
                learner.learn(10**12, callback=CallbackList([*callbacks_of(learner), self]))
            except RunIsOver:
                pass
            finally:
                self._watcher.end()
                learner.logger.close()
            if interrupt.is_set():
                raise KeyboardInterrupt

    def _on_training_start(self) -> None:
        self._watcher.begin()

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        history = self.history
        history.updates += not self._first
        self._first = False
        history.elapsed_s = time.monotonic() - self._began
        history.cpu_s = time.process_time() - self._cpu_began
        progress = self._limits.progress(history.elapsed_s, history.updates)
        self._watcher.advance(progress, history.elapsed_s, self.num_timesteps)
        over = progress >= 1.0
        if over or progress >= self._next_check:
            self._check()
            self._next_check = progress + self._check_every
        if over or self._asked_to_stop():
            raise RunIsOver

    def _check(self) -> None:
        found = self._evaluate()
        if self.best is None or found.score > self.best.score:
            self.best = found
        self._watcher.evaluated(self.history.elapsed_s, found.success)
        for name, (success, _) in found.figures.items():
            self.logger.record(f"held_out/{name}", success)

    def of_task(self, name: str) -> RunHistory:
        """The history as that of a training of one task."""
        assert self.best is not None
        history, (success, score) = self.history, self.best.figures[name]
        check = Check(history.elapsed_s, self.num_timesteps, success, score)
        return RunHistory(
            history.elapsed_s, history.cpu_s, history.updates, [check], (check, self.best.networks[name])
        )


def _worlds_of(
    plan: ContinualPlan, tasks: Mapping[str, Task], before: JointNetwork | None
) -> dict[str, VecNormalize]:
    """Worlds of each task, normalised; of tasks that are not rehearsed those that their networks are made from."""
    settings, stage = plan.settings, len(tasks) - 1
    assert isinstance(settings.algorithm, Ppo)  # as of the plan
    each = max(1, int(plan.rehearsed * settings.worlds / stage)) if stage else 0
    counts = dict.fromkeys(list(tasks)[:-1], each)
    counts[list(tasks)[-1]] = settings.worlds - (each * stage if plan.rehearsed else 0)
    parts = {}
    for name, worlds in counts.items():
        batch = BatchVecEnv(
            plan.learner, tasks[name], load_scenario(settings.scenario),
            worlds=worlds, seed=plan.seed + STAGE_SEEDS * stage, reward_scale=settings.reward_scale,
            action_space=settings.action_space, valve_cost=settings.valve_cost, compiled=settings.compiled,
        )  # fmt: skip
        statistics = before.statistics.get(name) if before else None
        parts[name] = normalised(batch, settings.algorithm.gamma, statistics)
    return parts


def _batch(part: VecNormalize) -> BatchVecEnv:
    assert isinstance(part.venv, BatchVecEnv)
    return part.venv


def _write_run_folders(plan: ContinualPlan, tasks: Mapping[str, Task], stage: Stage) -> None:
    """Write the network of each task, and its record, into a folder of its name."""
    for name, task in tasks.items():
        folder = plan.out / name
        folder.mkdir(exist_ok=True)
        history = stage.of_task(name)
        assert history.best is not None
        write_training_settings(plan.settings, folder / SETTINGS_FILE)
        save_network(history.best[1], folder / NETWORK_FILE)
        record = run_record(
            plan.learner, task, plan.settings, history,
            seed=plan.seed, steps=stage.num_timesteps, command=plan.command, git_revision=plan.git_revision,
        )  # fmt: skip
        write_run_record(folder, record | {"learned_tasks": list(tasks)})
