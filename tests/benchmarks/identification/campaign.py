"""Many machines at once, and what came of them in one document."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from typing import Any

import numpy as np

from fulmar_benchmarks.workers import ended_with_us, one_thread_each
from tests.benchmarks.identification.trial import Trial, run_trial

ASKED = ("mass", "yaw_inertia", "thrust")  # of platforms
MOST_ERROR_PERCENT = 3.0
LEAST_COVERAGE = 0.9
PLATFORM = "floating_platform"


def run_identification(
    trials: Sequence[Trial], *, jobs: int, on_done: Callable[[dict[str, Any]], None] = lambda result: None
) -> list[dict[str, Any]]:
    """Run trials in processes of their own; results in the order of the trials.

    Args:
        trials: What to do.
        jobs: Processes at once.
        on_done: Given each result as it comes.
    """
    results: dict[int, dict[str, Any]] = {}
    spawn = multiprocessing.get_context("spawn")
    with one_thread_each(), ended_with_us(ProcessPoolExecutor(jobs, spawn)) as pool:
        futures = {pool.submit(run_trial, trial): i for i, trial in enumerate(trials)}
        for future in as_completed(futures):
            results[futures[future]] = future.result()
            on_done(future.result())
    return [results[i] for i in range(len(trials))]


def document_of(results: Sequence[dict[str, Any]], *, seed: int) -> dict[str, Any]:
    """Figures of every robot's quantities, each machine's own numbers, and what was asked beside what was found."""
    robots = list(dict.fromkeys(result["robot"] for result in results))
    figures = {robot: _figures([r for r in results if r["robot"] == robot]) for robot in robots}
    asked = [
        {
            "quantity": name,
            "worst_error_percent": figures[PLATFORM][name]["worst_error_percent"],
            "most_error_percent": MOST_ERROR_PERCENT,
            "coverage": figures[PLATFORM][name]["coverage"],
            "least_coverage": LEAST_COVERAGE,
            "met": figures[PLATFORM][name]["worst_error_percent"] <= MOST_ERROR_PERCENT
            and figures[PLATFORM][name]["coverage"] >= LEAST_COVERAGE,
        }
        for name in ASKED
        if PLATFORM in figures
    ]
    return {
        "seed": seed,
        "figures": figures,
        "required": asked,
        "asked": len(asked),
        "met": sum(line["met"] for line in asked),
        "machines": list(results),
    }


def _figures(results: Sequence[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    figures = {}
    for name, first in results[0]["quantities"].items():
        every = [result["quantities"][name] for result in results]
        errors = [each["error_percent"] for each in every if each["error_percent"] is not None]
        off = [abs(each["value"] - each["truth"]) for each in every]
        figures[name] = {
            "unit": first["unit"],
            "machines": len(every),
            "mean_error_percent": float(np.mean(errors)) if errors else None,
            "worst_error_percent": float(np.max(errors)) if errors else None,
            "worst_error": float(np.max(off)),
            "mean_half_width": float(np.mean([0.5 * (each["high"] - each["low"]) for each in every])),
            "coverage": float(np.mean([each["inside"] for each in every])),
        }
    return figures
