"""Train a policy in the core's batch; leaves a run folder that `export` reads."""

from __future__ import annotations

import platform
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import CallbackList
from stable_baselines3.common.logger import KVWriter, configure
from stable_baselines3.common.vec_env import VecNormalize

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.seeds import EVALUATION_SEEDS
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.geofence import check_starts
from fulmar_core.tasks import Task
from fulmar_core.worlds.scenario import load_scenario
from training.checkpoint import load_checkpoint
from training.evaluator import held_out_evaluator
from training.fallback_policy import FallbackPolicy
from training.learners import begin_near, build_learner, callbacks_of, first_action
from training.network import save_network
from training.progress import LearningBar, Watcher
from training.run_folder import (
    CHECKPOINT_FILE,
    NETWORK_FILE,
    SETTINGS_FILE,
    START_FILE,
    TENSORBOARD_FOLDER,
    write_run_record,
    write_start,
)
from training.session import Limits, RunHistory, RunIsOver, Session, polite_interrupt
from training.settings import OffPolicy, TrainingSettings, write_training_settings
from training.vec_env import BatchVecEnv


def check_seed(seed: int) -> None:
    """Reject seeds that are reserved for evaluation.

    Raises:
        ConfigError: The seed is negative or reserved.
    """
    if seed < 0 or seed in EVALUATION_SEEDS:
        reserved = " and ".join(map(str, EVALUATION_SEEDS))
        raise ConfigError(
            f"seed {seed} must not be negative, nor {reserved}, which are reserved for evaluation."
        )


def begin_run(
    robot: Robot,
    task: Task,
    settings: TrainingSettings,
    *,
    seed: int,
    out: Path,
    time_limit_s: float | None,
    updates: int | None,
) -> None:
    """Write what `fulmar train --resume` needs into a run folder; arguments as in `train`.

    What is there already stays: `train` may do only a part of the run that was asked for.
    """
    if (out / START_FILE).is_file():
        return
    out.mkdir(parents=True, exist_ok=True)
    write_training_settings(settings, out / SETTINGS_FILE)
    asked = {"robot": robot.name, "task": task.name, "seed": seed}
    write_start(out, asked | {"time_limit_s": time_limit_s, "updates": updates})


def train(
    robot: Robot,
    task: Task,
    settings: TrainingSettings,
    *,
    seed: int,
    out: Path,
    time_limit_s: float | None = None,
    updates: int | None = None,
    resume: bool = False,
    command: str = "",
    git_revision: str = "",
    fallback: FallbackPolicy | None = None,
    watcher: Watcher | None = None,
    curves: KVWriter | None = None,
) -> dict[str, Any]:
    """Learn until a limit is reached, the task is learned, or the user interrupts.

    Args:
        robot: The robot.
        task: The task.
        settings: Of the run.
        seed: Seed of everything random, >= 0, and not one of `EVALUATION_SEEDS`.
        out: Run folder; made if need be.
        time_limit_s: Wall-clock of learning; the settings' by default, none if `updates` are given [s].
        updates: Number of updates; by default the time limit decides.
        resume: Continue from the checkpoint in `out`, exactly.
        command: Command line that started this, for the record.
        git_revision: Commit of the code, for the record.
        fallback: Policy that takes over when the robot is uncontrollable.
        watcher: Receives the progress; a progress bar by default.
        curves: Writer of curves beside TensorBoard.

    Returns:
        The content of `run.json`.

    Raises:
        ConfigError: The seed is reserved, the task starts beyond the robot's geofence, or there is nothing to resume.
        KeyboardInterrupt: The user ended it; the run folder is finished with the best network so far.
    """
    check_seed(seed)
    check_starts(robot, task)
    check_starts(robot, task, training=True)
    if time_limit_s is None and updates is None:
        time_limit_s = settings.time_limit_s
    torch.set_num_threads(1)  # a second core gives one small network a fifth more, and a second run all of it
    scenario = load_scenario(settings.scenario)
    worlds = BatchVecEnv(
        robot,
        task,
        scenario,
        worlds=settings.worlds,
        seed=seed,
        reward_scale=settings.reward_scale,
        disturbance_inputs=settings.disturbance_inputs,
        body_inputs=settings.body_inputs,
        action_space=settings.action_space,
        valve_cost=settings.valve_cost,
        mirror=settings.mirror,
        action_hold=settings.incremental_actions.hold if settings.incremental_actions else 0,
        compiled=settings.compiled,
    )
    history = RunHistory()
    if resume:
        learner, more = load_checkpoint(out / CHECKPOINT_FILE, settings.algorithm, worlds)
        history = more["history"]
    else:
        begin_run(robot, task, settings, seed=seed, out=out, time_limit_s=time_limit_s, updates=updates)
        env = VecNormalize(worlds, norm_reward=False, gamma=settings.algorithm.gamma)
        learner = build_learner(settings.algorithm, env, seed=seed)
        begin_near(learner, first_action(robot, task))
    _log_to(learner, out / TENSORBOARD_FOLDER, curves)
    with polite_interrupt() as interrupt:
        session = Session(
            history,
            evaluator=held_out_evaluator(robot, task, scenario),
            settings=settings,
            limits=Limits(time_limit_s, updates),
            worlds=worlds,
            command_scale=robot.actuators.scale,
            fallback=fallback,
            watcher=watcher or LearningBar(),
            checkpoint=out / CHECKPOINT_FILE,
            asked_to_stop=interrupt.is_set,
        )
        unsaved: OSError | None = None
        try:
            interrupted = _learn(learner, session, settings) or interrupt.is_set()
        except OSError as error:  # a full disk has room for the network sooner than for a checkpoint
            if history.best is None:
                raise
            unsaved, interrupted = error, True
        finally:
            learner.logger.close()
    assert history.best is not None
    best, network = history.best
    save_network(network, out / NETWORK_FILE)
    record = {
        "robot": robot.name,
        "task": task.name,
        "seed": seed,
        "command": command,
        "git_revision": git_revision,
        "control_hz": robot.timing.control_hz,
        "settings": asdict(settings),
        "steps": learner.num_timesteps * worlds.hold,
        "updates": history.updates,
        "wall_s": round(history.elapsed_s, 1),
        "cpu_s": round(history.cpu_s, 2),
        "steps_per_s": round(session.steps_per_s),
        "interrupted": interrupted,
        "best": asdict(best),
        "curve": [asdict(check) for check in history.checks],
        "versions": {name: version(name) for name in ("torch", "stable-baselines3", "sb3-contrib", "numpy")}
        | {"python": platform.python_version()},
    }
    write_run_record(out, record)
    if unsaved is not None:
        raise unsaved
    if interrupted:
        raise KeyboardInterrupt
    return record


def _learn(learner: BaseAlgorithm, session: Session, settings: TrainingSettings) -> bool:
    """Learn until the session ends it; returns whether the user interrupted first."""
    callbacks = CallbackList([*callbacks_of(learner), session])
    # An off-policy learner counts a single step of all worlds as an iteration.
    every = 100 if isinstance(settings.algorithm, OffPolicy) else 1
    try:
        learner.learn(10**12, callback=callbacks, log_interval=every, reset_num_timesteps=False)
    except RunIsOver:
        return False
    except KeyboardInterrupt:
        if session.history.best is None:
            raise
        return True
    finally:
        session.on_training_end()
    raise AssertionError("learning has no end of its own")


def _log_to(learner: BaseAlgorithm, folder: Path, curves: KVWriter | None) -> None:
    logger = configure(str(folder), ["tensorboard"])
    if curves is not None:
        logger.output_formats.append(curves)
    learner.set_logger(logger)
