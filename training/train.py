"""Learn a controller in the core's batch and leave a run folder that `export` understands."""

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

from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.episode import EVALUATION_SEEDS
from fulmar_core.errors import ConfigError
from fulmar_core.robot import Robot
from fulmar_core.safety.geofence import check_starts
from fulmar_core.tasks import Task
from training.checkpoint import load_checkpoint
from training.checks import held_out_judge
from training.fallback_policy import Specialist
from training.interrupt import polite_interrupt
from training.learners import build_learner, callbacks_of
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
from training.session import Limits, RunIsOver, Session, Story
from training.settings import OffPolicy, TrainingSettings, write_training_settings
from training.vec_env import BatchVecEnv


def check_seed(seed: int) -> None:
    """Refuse seeds that no run may learn from.

    Raises:
        ConfigError: If the seed is negative, or one of those kept for judging.
    """
    if seed < 0 or seed in EVALUATION_SEEDS:
        kept = " and ".join(str(kept) for kept in EVALUATION_SEEDS)
        raise ConfigError(f"seed {seed} must not be negative, nor {kept}, which are kept for judging.")


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
    """Write into a run folder what `fulmar train --resume` needs to know; arguments as of `train`.

    Where it is written already, it stays: `train` may be asked for a part of what the whole run was asked for.
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
    specialist: Specialist | None = None,
    watcher: Watcher | None = None,
    curves: KVWriter | None = None,
) -> dict[str, Any]:
    """Learn until a limit is reached, the task is learned, or a person has seen enough.

    Args:
        robot: The robot.
        task: The task.
        settings: How to learn.
        seed: Seed of everything random, >= 0, and none of `EVALUATION_SEEDS`.
        out: Run folder; made if need be.
        time_limit_s: Wall-clock of learning; the settings' by default, none if `updates` are given [s].
        updates: How many updates to do; as many as there is time for by default.
        resume: Go on from the checkpoint in `out`, exactly.
        command: Command line that started this, for the record.
        git_revision: Commit of the code, for the record.
        specialist: Who takes over where too many valves are dead.
        watcher: Whom to tell how it goes; a progress bar by default.
        curves: Where curves go beside TensorBoard.

    Returns:
        What `run.json` says.

    Raises:
        ConfigError: If the seed is one of those kept for judging, the task starts beyond the robot's geofence, or there
            is nothing to resume.
        KeyboardInterrupt: A person ended it; the run folder is finished with the best network so far.
    """
    check_seed(seed)
    check_starts(robot, task)
    check_starts(robot, task, training=True)
    if time_limit_s is None and updates is None:
        time_limit_s = settings.time_limit_s
    torch.set_num_threads(
        1
    )  # networks this small gain a fifth from a second core, and two runs gain all of it
    scenario = load_scenario(settings.scenario)
    worlds = BatchVecEnv(
        robot,
        task,
        scenario,
        worlds=settings.worlds,
        seed=seed,
        reward_scale=settings.reward_scale,
        told=settings.told,
        wrench=settings.wrench,
        gas=settings.gas,
        mirror=settings.mirror,
        orders_held=settings.orders.hold if settings.orders else 0,
        compiled=settings.compiled,
    )
    story = Story()
    if resume:
        learner, more = load_checkpoint(out / CHECKPOINT_FILE, settings.algorithm, worlds)
        story = more["story"]
    else:
        begin_run(robot, task, settings, seed=seed, out=out, time_limit_s=time_limit_s, updates=updates)
        env = VecNormalize(worlds, norm_reward=False, gamma=settings.algorithm.gamma)
        learner = build_learner(settings.algorithm, env, seed=seed)
    _log_to(learner, out / TENSORBOARD_FOLDER, curves)
    with polite_interrupt() as interrupt:
        session = Session(
            story,
            judge=held_out_judge(robot, task, scenario),
            settings=settings,
            limits=Limits(time_limit_s, updates),
            worlds=worlds,
            command_scale=robot.actuators.scale,
            specialist=specialist,
            watcher=watcher or LearningBar(),
            checkpoint=out / CHECKPOINT_FILE,
            asked_to_stop=interrupt.is_set,
        )
        unsaved: OSError | None = None
        try:
            interrupted = _learn(learner, session, settings) or interrupt.is_set()
        except OSError as error:  # a full disk has room for the network sooner than for a checkpoint
            if story.best is None:
                raise
            unsaved, interrupted = error, True
        finally:
            learner.logger.close()
    assert story.best is not None
    best, network = story.best
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
        "updates": story.updates,
        "wall_s": round(story.elapsed_s, 1),
        "steps_per_s": round(session.steps_per_s),
        "interrupted": interrupted,
        "best": asdict(best),
        "curve": [asdict(check) for check in story.checks],
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
    """Learn until the session ends it; returns whether a person broke it off before it could."""
    callbacks = CallbackList([*callbacks_of(learner), session])
    # An off-policy learner counts a single step of all worlds as an iteration.
    every = 100 if isinstance(settings.algorithm, OffPolicy) else 1
    try:
        learner.learn(10**12, callback=callbacks, log_interval=every, reset_num_timesteps=False)
    except RunIsOver:
        return False
    except KeyboardInterrupt:
        if session.story.best is None:
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
