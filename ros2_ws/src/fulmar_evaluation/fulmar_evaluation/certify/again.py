"""A set that a passport or a law's file already has, tested on fresh episodes of today's core."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.loop.policy_bundle import read_passport
from fulmar_core.safety.certified_set import CertifiedSet, read_certified_set, set_of_bundle
from fulmar_evaluation.certify.confidence import lower_bound
from fulmar_evaluation.certify.document import plain_axes
from fulmar_evaluation.certify.episodes import Episodes
from fulmar_evaluation.certify.fit import Fit
from fulmar_evaluation.certify.procedure import ALPHA, LEAST, LEAST_EDGE, Result, Run, Sizes, Tested
from fulmar_evaluation.certify.sets import Box, ConditionSet, ScoreSet, outer_sample
from fulmar_evaluation.evaluation import Trial

C = TypeVar("C", bound=ConditionSet)
AGAIN = 2  # stream of the conditions, beside those of a search


def known_set(episodes: Episodes, file: Path | None) -> CertifiedSet:
    """The set in the passport of a trial's bundle, or in the file of a law.

    Args:
        episodes: What is certified, with the axes of today.
        file: Of a law.

    Raises:
        BundleError: The passport has none, or one of another robot or task.
        ConfigError: The file cannot be read or is of something else, or the axes of the robot's kind are others now.
    """
    trial, policy = episodes.trial, episodes.trial.plan.policy
    where = str(policy or file)
    if policy:
        found = set_of_bundle(read_passport(Path(policy)).envelope, trial.robot, trial.task.name, where)
    else:
        found = _set_of_law(trial, file)
    if found.plain["axes"] != plain_axes(episodes.axes):
        raise ConfigError(
            f"{where}: its certified set has other axes than '{trial.robot.name}' has now. Certify it without --again."
        )
    if found.plain.get("dead", 0) != episodes.dead:
        raise ConfigError(
            f"{where}: its certified set is of --dead {found.plain['dead']}; give the same here."
        )
    return found


def _set_of_law(trial: Trial, file: Path | None) -> CertifiedSet:
    """The set in the file of a law, for this very law, robot and task."""
    if file is None:
        raise ConfigError(
            "--again tests what --out FILE has of a law; give --out, or the folder of a bundle."
        )
    found = read_certified_set(file)
    its = found.robot, found.task, found.controller
    asked = trial.robot.name, trial.task.name, trial.plan.controller
    if its != asked:
        raise ConfigError(f"{file}: is of {' · '.join(its)}, not {' · '.join(asked)}.")
    return found


def tested_again(known: CertifiedSet, run: Run, sizes: Sizes, seed: int) -> Result:
    """Test a set and its box on fresh episodes.

    Args:
        known: The set.
        run: Runs episodes.
        sizes: Numbers of episodes.
        seed: Of the conditions that are drawn.

    Returns:
        As of a search; without a set where it no longer meets its bounds.
    """
    rng = np.random.default_rng([seed, len(known.axes), AGAIN])
    score = ScoreSet(known.linear, known.quadratic, known.threshold)
    high = np.array([axis.share(known.box[axis.name][1]) for axis in known.axes])
    fit = Fit(known.linear, known.quadratic, 0.0)
    empty = np.empty((0, len(known.axes))), np.empty(0, dtype=bool)
    found, reason = _tested(score, run, sizes, rng)
    if found is None:
        return Result(fit, None, None, *empty, f"the known set no longer meets its bounds: {reason}")
    box = None if not high.all() else _tested(Box(high), run, sizes, rng)[0]
    return Result(fit, found, box, *empty, "")


def _tested(of: C, run: Run, sizes: Sizes, rng: np.random.Generator) -> tuple[Tested[C] | None, str]:
    """One test of a set, and in words how it went."""
    inside, edge = run(of.sample(rng, sizes.test)), run(outer_sample(of, rng, sizes.edge))
    bound = lower_bound(int(inside.sum()), len(inside), ALPHA)
    words = f"lower bound {bound:.3f} of {LEAST:g}, outer tenth {edge.mean():.3f} of {LEAST_EDGE:g}"
    if bound < LEAST or edge.mean() < LEAST_EDGE:
        return None, words
    counts = len(inside), int(inside.sum()), bound, len(edge), int(edge.sum())
    return Tested(of, *counts, 1), words
