"""Settings of sheeprl from ours."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

from training.dreamer_request import Request
from training.run_folder import CHECKPOINT_FILE, TENSORBOARD_FOLDER
from training.settings import Dreamer, TrainingSettings

NEVER = 10**12  # control steps between two checkpoints: our session asks for each


def sheeprl_settings(request: Request, settings: TrainingSettings) -> Any:
    """The configuration that `sheeprl.cli.run_algorithm` takes."""
    hydra, conf = importlib.import_module("hydra"), importlib.import_module("omegaconf").OmegaConf
    with hydra.initialize_config_module("sheeprl.configs", version_base="1.3"):
        composed = hydra.compose("config", overrides=_overrides(request, settings))
    plain = conf.to_container(composed, resolve=True, throw_on_missing=True)
    # Paths and names of functions are no overrides: hydra would read some of their characters as syntax.
    plain["log_root"] = str(Path(request.out) / TENSORBOARD_FOLDER)
    plain["env"]["wrapper"] = {"_target_": "training.dreamer_learning.make_world", "seed": 0, "rank": 0}
    plain["fabric"]["callbacks"] = [{"_target_": "training.dreamer_learning.make_callback"}]
    if request.resume:
        plain["checkpoint"]["resume_from"] = str(Path(request.out) / CHECKPOINT_FILE)
    return importlib.import_module("sheeprl.utils.utils").dotdict(plain)


def _overrides(request: Request, settings: TrainingSettings) -> list[str]:
    algorithm = settings.algorithm
    assert isinstance(algorithm, Dreamer)
    chosen: dict[str, object] = {
        "exp": "dreamer_v3",
        "algo": "dreamer_v3_XS",
        "env": "gym",
        "seed": request.seed,
        "num_threads": 1,
        "float32_matmul_precision": "highest",
        "root_dir": "dreamer",
        "run_name": "run",
        "env.num_envs": settings.worlds,
        "env.sync_env": True,
        "env.capture_video": False,
        "fabric.accelerator": "cpu",
        "fabric.devices": 1,
        "algo.cnn_keys.encoder": "[]",
        "algo.cnn_keys.decoder": "[]",
        "algo.mlp_keys.encoder": "[vector]",
        "algo.mlp_keys.decoder": "[vector]",
        "algo.dense_units": algorithm.dense,
        "algo.mlp_layers": algorithm.layers,
        "algo.world_model.recurrent_model.recurrent_state_size": algorithm.recurrent,
        "algo.world_model.transition_model.hidden_size": algorithm.dense,
        "algo.world_model.representation_model.hidden_size": algorithm.dense,
        "algo.world_model.stochastic_size": algorithm.groups,
        "algo.world_model.discrete_size": algorithm.classes,
        "algo.per_rank_batch_size": algorithm.minibatch,
        "algo.per_rank_sequence_length": algorithm.sequence,
        "algo.horizon": algorithm.horizon,
        "algo.replay_ratio": algorithm.replay_ratio,
        "algo.learning_starts": algorithm.first_steps,
        "algo.gamma": algorithm.gamma,
        "algo.world_model.optimizer.lr": algorithm.learning_rate,
        "algo.actor.optimizer.lr": algorithm.actor_rate,
        "algo.critic.optimizer.lr": algorithm.actor_rate,
        "algo.total_steps": NEVER,
        "algo.run_test": False,
        "buffer.size": algorithm.buffer,
        "buffer.memmap": False,
        "buffer.checkpoint": True,
        "checkpoint.every": NEVER,
        "checkpoint.save_last": False,
    }
    return [f"{key}={value}" for key, value in chosen.items()]
