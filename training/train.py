"""Learn a controller in the core's batch and leave a run folder that `export` understands.

A run folder holds `run.json` (what was done), `network.pt` (the best weights) and `tensorboard/`, also when a person
ended the run early.
"""

from __future__ import annotations

import json
import platform
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import torch
from stable_baselines3.common.callbacks import BaseCallback, CallbackList
from stable_baselines3.common.vec_env import VecNormalize

from fulmar_core.disturbances.scenario import Scenario, load_scenario
from fulmar_core.episode import HELD_OUT_SEED, JUDGING_SEEDS
from fulmar_core.errors import ConfigError
from fulmar_core.metrics import summary
from fulmar_core.robot import Robot
from fulmar_core.rollout import roll_out_in_batch
from fulmar_core.tasks import Task
from training.network import DeployedNetwork, NetworkController, deployed_network, save_network
from training.ppo import build_ppo
from training.progress import LearningBar
from training.settings import TrainingSettings
from training.vec_env import BatchVecEnv

NETWORK_FILE = "network.pt"
RUN_FILE = "run.json"


Judge = Callable[[DeployedNetwork], tuple[float, float]]  # success rate and score


@dataclass(frozen=True)
class Check:
    """One look at the learner on held-out episodes, in the batch."""

    wall_s: float
    steps: int
    success_rate: float  # mean of the training scenario and the nominal one
    score: float  # orders checks: success first, then precision, then economy


class _TimedLearning(BaseCallback):
    """Checks the learner now and then, keeps the best network, and stops when time is up."""

    def __init__(
        self,
        judge: Judge,
        settings: TrainingSettings,
        limit: float,
    ) -> None:
        super().__init__()
        self._judge, self._settings, self._limit = judge, settings, limit
        self._began = time.monotonic()
        self._next_check = settings.evaluate_every_s
        self._bar = LearningBar(limit)
        self.checks: list[Check] = []
        self.best: tuple[Check, DeployedNetwork] | None = None

    def _on_training_start(self) -> None:
        self._bar.__enter__()

    def _on_training_end(self) -> None:
        self._bar.__exit__(None, None, None)

    def _on_step(self) -> bool:
        return True

    @property
    def elapsed_s(self) -> float:
        """Wall-clock since the beginning [s]."""
        return time.monotonic() - self._began

    def _on_rollout_end(self) -> None:
        elapsed = self.elapsed_s
        self._bar.advance(min(elapsed, self._limit), self.num_timesteps)

    def _on_rollout_start(self) -> None:
        elapsed = self.elapsed_s
        if elapsed >= min(self._next_check, self._limit):
            self._check(elapsed)
            self._next_check = elapsed + self._settings.evaluate_every_s

    def _check(self, elapsed: float) -> None:
        normaliser = self.model.get_vec_normalize_env()
        assert normaliser is not None
        network = deployed_network(self.model, normaliser)  # type: ignore[arg-type]
        success, score = self._judge(network)
        check = Check(elapsed, self.num_timesteps, success, score)
        if self.best is None or score > self.best[0].score:
            self.best = check, network  # at once, since a person may interrupt anywhere
        self.checks.append(check)
        self._bar.verdict(elapsed, f"success {success:.3f}")
        self.logger.record("held_out/success_rate", success)
        self.logger.record("held_out/score", score)
        if elapsed >= self._limit:
            raise _TimeIsUp


class _TimeIsUp(Exception):  # noqa: N818 - it is the planned end, no error
    """Ends learning between two updates."""


def train(
    robot: Robot,
    task: Task,
    settings: TrainingSettings,
    *,
    seed: int,
    out: Path,
    time_limit_s: float | None = None,
    command: str = "",
    git_revision: str = "",
) -> dict[str, Any]:
    """Learn until the time is up.

    Args:
        robot: The robot.
        task: The task.
        settings: How to learn.
        seed: Seed of everything random, >= 0, and none of `JUDGING_SEEDS`.
        out: Run folder; made if need be.
        time_limit_s: Wall-clock of learning; the settings' by default [s].
        command: Command line that started this, for the record.
        git_revision: Commit of the code, for the record.

    Returns:
        What `run.json` says.

    Raises:
        ConfigError: If the seed is one of those kept for judging.
        KeyboardInterrupt: A person ended it; the run folder is finished with the best network so far, if there
            is one yet.
    """
    if seed < 0 or seed in JUDGING_SEEDS:
        kept = " and ".join(str(kept) for kept in JUDGING_SEEDS)
        raise ConfigError(f"seed {seed} must not be negative, nor {kept}, which are kept for judging.")
    limit = time_limit_s or settings.time_limit_s
    torch.set_num_threads(1)  # a second thread gains little here and loses much when the machine is shared
    scenario = load_scenario(settings.scenario)
    out.mkdir(parents=True, exist_ok=True)
    ppo = settings.ppo
    worlds = BatchVecEnv(robot, task, scenario, worlds=ppo.worlds, seed=seed, reward_scale=ppo.reward_scale)
    env = VecNormalize(worlds, norm_reward=False, gamma=ppo.gamma)
    learner, feedback = build_ppo(ppo, env, seed=seed, tensorboard=str(out / "tensorboard"))
    learning = _TimedLearning(_judge_of(robot, task, scenario), settings, limit)
    interrupted: KeyboardInterrupt | None = None
    try:
        learner.learn(total_timesteps=10**12, callback=CallbackList([feedback, learning]))
    except _TimeIsUp:
        pass
    except KeyboardInterrupt as error:
        if learning.best is None:
            raise
        interrupted = error
    finally:
        learning.on_training_end()
    assert learning.best is not None
    best, network = learning.best
    save_network(network, out / NETWORK_FILE)
    record = {
        "robot": robot.name,
        "task": task.name,
        "seed": seed,
        "command": command,
        "git_revision": git_revision,
        "control_hz": robot.timing.control_hz,
        "settings": asdict(settings),
        "steps": learner.num_timesteps,
        "wall_s": round(learning.elapsed_s, 1),
        "interrupted": interrupted is not None,
        "best": asdict(best),
        "curve": [asdict(check) for check in learning.checks],
        "versions": {name: version(name) for name in ("torch", "stable-baselines3", "numpy")}
        | {"python": platform.python_version()},
    }
    (out / RUN_FILE).write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
    if interrupted is not None:
        raise interrupted
    return record


def _judge_of(robot: Robot, task: Task, scenario: Scenario) -> Judge:
    """Judge in the training scenario and in the nominal one: a network may be good at either alone."""
    worlds = (scenario, load_scenario("nominal"))

    def judge(network: DeployedNetwork) -> tuple[float, float]:
        controller = NetworkController(network, task.observation_names, robot.timing.control_hz)
        figures = [
            summary(roll_out_in_batch(controller, robot, task, world, episodes=256, seed=HELD_OUT_SEED), task)
            for world in worlds
        ]
        success = _mean(figures, "success_rate")
        return success, success + 0.5 * _mean(figures, "PT2_percent") / 100.0 - _mean(figures, "AAS")

    return judge


def _mean(figures: list[dict[str, Any]], name: str) -> float:
    values = [each[name]["mean"] if isinstance(each[name], dict) else each[name] for each in figures]
    return float(sum(values)) / len(values)
