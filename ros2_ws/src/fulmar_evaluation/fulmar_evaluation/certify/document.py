"""What a certification leaves behind: one document, ready for JSON, for the passport of a bundle or a file of a law."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from fulmar_core.config.atomic_write import write_whole
from fulmar_core.config.errors import BundleError, ConfigError
from fulmar_core.config.provenance import fulmar_version
from fulmar_core.config.source_hash import core_sha256, file_sha256, robot_sha256
from fulmar_core.loop.policy_bundle import read_bundle, reseal
from fulmar_core.safety.certified_set import FORMAT, Axis, read_certified_set
from fulmar_core.safety.declared_conditions import certified_body
from fulmar_evaluation.certify.confidence import lower_bound
from fulmar_evaluation.certify.procedure import ALPHA, Result, Tested
from fulmar_evaluation.evaluation import Trial

CONFIDENCE = 1.0 - ALPHA
DIGITS = 6  # of the weights and sides that are written


def document_of(trial: Trial, axes: tuple[Axis, ...], result: Result, *, seed: int) -> dict[str, Any]:
    """A certified set as a passport holds it, without what MuJoCo and the clock add.

    Args:
        trial: What was certified.
        axes: Of the conditions.
        result: Has a score.
        seed: Of the conditions and the episodes.
    """
    score, box = result.score, result.box
    assert score is not None
    high = box.set.high if box is not None else 0.0 * result.fit.linear
    found: dict[str, Any] = {
        "format": FORMAT,
        "robot": trial.robot.name,
        "task": trial.task.name,
        "controller": trial.plan.controller,
        "body": certified_body(trial.robot),
        "axes": plain_axes(axes),
        "box": {a.name: [a.low, _short(a.low + (a.high - a.low) * high[i])] for i, a in enumerate(axes)},
        "score": {
            "weights": {
                "linear": [_short(weight) for weight in score.set.linear],
                "quadratic": [[_short(weight) for weight in row] for row in score.set.quadratic],
            },
            "threshold": _short(score.set.threshold),
        },
        **_bounds(score),
        "confidence": CONFIDENCE,
        "box_test": None if box is None else _bounds(box),
        "mujoco": None,
        "seeds": {"conditions": seed, "episodes": trial.plan.seed},
        "control_hz": trial.plan.control_hz,
        "simulator": f"fulmar_core {fulmar_version()}",
    }
    return found


def plain_axes(axes: tuple[Axis, ...]) -> list[dict[str, Any]]:
    """Axes, ready for JSON."""
    return [{"name": a.name, "low": a.low, "high": a.high, "unit": a.unit} for a in axes]


def _short(value: Any) -> float:
    return float(f"{float(value):.{DIGITS}g}")


def _bounds(found: Tested[Any]) -> dict[str, Any]:
    edge = {
        "mean": found.edge_successes / found.edge_episodes,
        "successes": found.edge_successes,
        "episodes": found.edge_episodes,
    }
    return {
        "episodes": found.episodes,
        "successes": found.successes,
        "lower_bound": found.lower_bound,
        "edge": edge,
        "tests": found.tests,
    }


def mujoco_bounds(successes: int, episodes: int) -> dict[str, Any]:
    """What an independent simulator measured."""
    return {
        "episodes": episodes,
        "successes": successes,
        "lower_bound": lower_bound(successes, episodes, ALPHA),
    }


def hashes_of(trial: Trial, backup: Path | None) -> dict[str, str]:
    """SHA-256 of the robot's file, of the core's sources and of the backup's certified set; empty without a backup."""
    return {
        "robot": robot_sha256(trial.plan.robot),
        "core": core_sha256(),
        "backup": "" if backup is None else file_sha256(backup),
    }


def check_backup(path: Path, trial: Trial) -> None:
    """Refuse a backup that is not certified for the same robot and task.

    Raises:
        ConfigError: With what to do.
    """
    if not path.is_file():
        raise ConfigError(
            f"backup '{path}' is not certified: there is no such file. Make one: fulmar certify classical "
            f"--robot {trial.plan.robot} --task {trial.plan.task} --out {path}"
        )
    found = read_certified_set(path)
    for what, mine, asked in (
        ("robot", found.robot, trial.plan.robot),
        ("task", found.task, trial.plan.task),
    ):
        if mine != asked:
            raise ConfigError(f"backup '{path}' is certified for {what} '{mine}', not '{asked}'.")


def write_into_passport(folder: Path, document: dict[str, Any]) -> str:
    """Put a certified set into the passport of a bundle, whose hash and signature change with it.

    Returns:
        What to do next, in words.

    Raises:
        BundleError: The bundle is damaged.
    """
    bundle = read_bundle(folder)
    signed = reseal(bundle, replace(bundle.passport, envelope=document))
    again = "Its signature is gone, since it was over the passport before. " if signed else ""
    return f"{again}Sign it: fulmar bundle sign {folder} --key FILE"


def write_file(path: Path, document: dict[str, Any]) -> None:
    """Write the certified set of a law."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole({path: (json.dumps(document, indent=2) + "\n").encode()})


def identity(trial: Trial) -> str:
    """Name of a law, or the hash of a bundle without its certified set.

    Raises:
        BundleError: The bundle is damaged.
    """
    if not trial.plan.policy:
        return trial.plan.controller
    passport = read_bundle(Path(trial.plan.policy)).passport
    if passport.robot != trial.plan.robot:
        raise BundleError(f"policy '{trial.plan.policy}' is of robot '{passport.robot}'.")
    return replace(passport, envelope=None).expected_sha256()
