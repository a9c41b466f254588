"""Checkpoint of a run in one file, for an exact resume.

It holds pickled objects: it is for resuming one's own run, and never read on a robot.
"""

from __future__ import annotations

import io
import pickle
import random
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.vec_env import VecNormalize

from fulmar_core.config.atomic_write import whole_file
from fulmar_core.config.errors import ConfigError
from training.learners import learner_class
from training.settings import Algorithm
from training.vec_env import BatchVecEnv

_NOT_SAVED = ("_last_lstm_states",)  # not saved by Stable-Baselines3


def save_checkpoint(path: Path, learner: BaseAlgorithm, more: dict[str, Any]) -> None:
    """Write a checkpoint, which replaces an older one only when it is complete."""
    normaliser = learner.get_vec_normalize_env()
    assert normaliser is not None
    worlds = normaliser.venv
    assert isinstance(worlds, BatchVecEnv)
    zipped = io.BytesIO()
    learner.save(zipped)
    content = {
        "learner": zipped.getvalue(),
        "not_saved": {name: getattr(learner, name) for name in _NOT_SAVED if hasattr(learner, name)},
        "replay": learner.replay_buffer if isinstance(learner, OffPolicyAlgorithm) else None,
        "normaliser": normaliser,  # pickles itself without its worlds
        "returns": normaliser.returns,
        "worlds": worlds.state(),
        "random": (random.getstate(), np.random.get_state(), torch.get_rng_state()),
        "first_actions": learner.action_space.np_random.bit_generator.state,
        "more": more,
    }
    with whole_file(path) as file:
        pickle.dump(content, file)


def load_checkpoint(
    path: Path, settings: Algorithm, worlds: BatchVecEnv
) -> tuple[BaseAlgorithm, dict[str, Any]]:
    """Restore a learner, with its worlds and every random number generator.

    Args:
        path: File that `save_checkpoint` wrote.
        settings: Those that the learner was built from.
        worlds: Built as they were then; brought to the state they had.

    Returns:
        The learner, and what was saved as `more`.

    Raises:
        ConfigError: No such file, or not a checkpoint.
    """
    try:
        with path.open("rb") as file:
            content = pickle.load(file)
    except OSError as error:
        raise ConfigError(f"{path}: no checkpoint to resume from ({error.strerror}).") from error
    except Exception as error:  # pickle raises exceptions of all kinds
        raise ConfigError(f"{path}: is no checkpoint ({type(error).__name__}).") from error
    try:
        return _restored(content, settings, worlds), content["more"]
    except (LookupError, AttributeError, TypeError, ValueError, RuntimeError, AssertionError) as error:
        raise ConfigError(
            f"{path}: was written by another version of Fulmar, or for another robot or task "
            f"({type(error).__name__}: {str(error)[:80]}). Begin again in another folder."
        ) from error


def _restored(content: dict[str, Any], settings: Algorithm, worlds: BatchVecEnv) -> BaseAlgorithm:
    normaliser: VecNormalize = content["normaliser"]
    worlds.reset()
    worlds.set_state(content["worlds"])
    normaliser.set_venv(worlds)
    normaliser.returns = content["returns"]
    learner = learner_class(settings).load(
        io.BytesIO(content["learner"]), env=normaliser, device="cpu", force_reset=False
    )
    for name, value in content["not_saved"].items():
        setattr(learner, name, value)
    if isinstance(learner, OffPolicyAlgorithm):
        learner.replay_buffer = content["replay"]
    learner.action_space.np_random.bit_generator.state = content["first_actions"]
    python, numpy, pytorch = content["random"]
    random.setstate(python)
    np.random.set_state(numpy)
    torch.set_rng_state(pytorch)
    return learner
