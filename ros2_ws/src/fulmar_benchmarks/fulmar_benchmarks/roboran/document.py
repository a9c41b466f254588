"""The outcome of a benchmark as one JSON-ready document: what tables, pages and other programs read."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from fulmar_benchmarks.pairs import Pair
from fulmar_benchmarks.results import PairResult
from fulmar_benchmarks.roboran.targets import checks_of, main_figure, thesis_row
from fulmar_core.simulation.metrics import summarise
from fulmar_evaluation.evaluation import share_of_mean
from fulmar_evaluation.success_interval import wilson

OF_A_CHECK = ("name", "measured", "limit", "met")


def pair_entry(pair: Pair, outcomes: dict[str, PairResult | str]) -> dict[str, Any]:
    """The entry of one pair.

    Returns:
        An entry of `pairs`; docs/evaluation.md names its keys.
    """
    evaluated = {way: outcome for way, outcome in outcomes.items() if isinstance(outcome, PairResult)}
    faults = [f"{way}: {outcome}" for way, outcome in outcomes.items() if isinstance(outcome, str)]
    figure = main_figure(pair.task)
    values = {way: _value(outcome, figure) for way, outcome in evaluated.items()}
    training_s = _seconds(pair.passport.get("wall_s"))
    same = evaluated["batch"].about.get("same_at_64_worlds") if "batch" in evaluated else None
    checks = (
        checks_of(pair.robot, pair.task, values, same=same, training_s=training_s)
        if pair.kind == "policy"
        else []
    )
    met = [check.met for check in checks]
    return {
        "robot": pair.robot,
        "task": pair.task,
        "kind": pair.kind,
        "controller": pair.controller or None,
        "law": pair.law or None,
        "status": "missing" if pair.missing else "failed" if faults or not evaluated else "judged",
        "reason": pair.reason or "; ".join(faults) or None,
        "sha256": pair.sha256 or None,
        "training_s": training_s,
        "judged_figure": figure,
        "judged": values,
        "judged_in_batch_on_mujocos_episodes": _on_mujocos_episodes(evaluated, figure),
        "same_at_64_worlds": same,
        "ways": {way: _way(outcome) for way, outcome in evaluated.items()},
        "thesis": dataclasses.asdict(thesis_row(pair.robot, pair.task))
        | {"time_to_target_s": thesis_row(pair.robot, pair.task).time_to_target_s},
        "verdicts": [{key: getattr(check, key) for key in OF_A_CHECK} for check in checks],
        "met": None if not met or None in met else all(met),
    }


def _way(outcome: PairResult) -> dict[str, Any]:
    figures = summarise(outcome.succeeded, outcome.figures)
    kept = {key: value for key, value in outcome.about.items() if key not in _OF_THE_PAIR}
    entry = {**kept, **figures}
    entry["success_interval"] = wilson(figures["success_rate"], figures["episodes"])
    if "goals_bound" in outcome.figures:
        entry["share_of_mean_bound"] = share_of_mean(
            outcome.figures["goals_reached"], outcome.figures["goals_bound"]
        )
    return entry


_OF_THE_PAIR = ("robot", "task", "controller", "through", "same_at_64_worlds", "goals")


def _value(outcome: PairResult, figure: str, episodes: int | None = None) -> float:
    values = outcome.succeeded if figure == "success_rate" else outcome.figures[figure]
    return float(np.nanmean(values[:episodes]))


def _on_mujocos_episodes(evaluated: dict[str, PairResult], figure: str) -> float | None:
    """The main figure of the batch on the very episodes that MuJoCo ran."""
    if not {"batch", "mujoco"} <= set(evaluated):
        return None
    return _value(evaluated["batch"], figure, len(evaluated["mujoco"].succeeded))


def _seconds(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None
