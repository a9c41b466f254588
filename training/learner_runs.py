"""One learner on a budget, for a comparison of learners: the same scenario, rate and held-out episodes for all."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.callbacks import BaseCallback, CallbackList
from stable_baselines3.common.vec_env import VecNormalize

from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import Task, load_task
from fulmar_core.worlds.scenario import load_scenario
from training.deploy import deployed_network
from training.dreamer_process import Learner, dreamer_python
from training.dreamer_request import Request
from training.learner_curve import Budget, Curve
from training.learners import begin_near, build_learner, callbacks_of, first_action
from training.run_folder import SETTINGS_FILE
from training.session import RunIsOver
from training.settings import (
    Dreamer,
    OnPolicy,
    TrainingSettings,
    load_training_settings,
    write_training_settings,
)
from training.vec_env import BatchVecEnv

SCENARIO = "nominal"


def learner_settings(learner: str, robot: Robot, task: Task) -> TrainingSettings:
    """Shipped settings of a learner: `ppo` those of the robot and the task, others by their own name."""
    settings = load_training_settings(robot, task, None if learner == "ppo" else learner)
    return replace(settings, scenario=SCENARIO, control_hz=None, annealing=None)


def run_learner(
    learner: str, robot_name: str, task_name: str, *, seed: int, budget: Budget, out: Path
) -> list[dict[str, Any]]:
    """Learn until the budget is used up; returns points of its curve, see `training.learner_curve`.

    Args:
        learner: `ppo`, or a file of `configs/training`.
        robot_name: The robot.
        task_name: The task.
        seed: Of the learner and its worlds.
        budget: Samples and processor time.
        out: Folder for what DreamerV3 writes.

    Raises:
        ConfigError: The learner does not fit the robot, or DreamerV3's environment is missing.
    """
    robot, task = load_robot(robot_name), load_task(task_name)
    settings = learner_settings(learner, robot, task)
    if isinstance(settings.algorithm, Dreamer):
        return _learn_apart(settings, robot, task, seed=seed, budget=budget, out=out)
    torch.set_num_threads(1)
    curve = Curve(robot, task, load_scenario(settings.scenario), budget)
    worlds = BatchVecEnv(
        robot, task, load_scenario(settings.scenario), worlds=settings.worlds, seed=seed,
        reward_scale=settings.reward_scale, action_space=settings.action_space, valve_cost=settings.valve_cost,
    )  # fmt: skip
    env = VecNormalize(worlds, norm_reward=False, gamma=settings.algorithm.gamma)
    algorithm = build_learner(settings.algorithm, env, seed=seed)
    begin_near(algorithm, first_action(robot, task))
    marks = _Marks(curve, settings, np.asarray(robot.actuators.scale))
    with contextlib.suppress(RunIsOver):
        algorithm.learn(10**12, callback=CallbackList([*callbacks_of(algorithm), marks]))
    return curve.points


class _Marks(BaseCallback):
    """Lets the curve look before each rollout."""

    def __init__(self, curve: Curve, settings: TrainingSettings, scale: np.ndarray) -> None:
        super().__init__()
        self._curve, self._settings, self._scale = curve, settings, scale
        self._updates = -1  # no update before the first rollout

    def _on_rollout_start(self) -> None:
        self._updates += 1
        normaliser = self.model.get_vec_normalize_env()
        assert normaliser is not None
        over = self._curve.look(
            self.num_timesteps,
            self._gradient_steps(),
            lambda: deployed_network(self.model, normaliser, self._scale, None),
        )
        if over:
            raise RunIsOver

    def _on_step(self) -> bool:
        return True

    def _gradient_steps(self) -> int:
        algorithm, worlds = self._settings.algorithm, self._settings.worlds
        if isinstance(algorithm, OnPolicy):
            return self._updates * algorithm.epochs * worlds * algorithm.steps // algorithm.minibatch
        return int(getattr(self.model, "_n_updates", 0))


def _learn_apart(
    settings: TrainingSettings, robot: Robot, task: Task, *, seed: int, budget: Budget, out: Path
) -> list[dict[str, Any]]:
    python = dreamer_python()
    out.mkdir(parents=True, exist_ok=True)
    write_training_settings(settings, out / SETTINGS_FILE)
    file, folder = (out / SETTINGS_FILE).absolute(), out.absolute()
    request = Request(robot.name, task.name, seed, str(file), str(folder), budget=budget)
    with Learner(request, python) as learner:
        return list(learner.listen(lambda _: None)["curve"])
