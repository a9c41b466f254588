"""The whole benchmark of inertia identification: estimators under every profile, and inertia that changes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_benchmarks.inertia.simulated_runs import (
    LEVELS,
    SAMPLE_S,
    WHEEL_STD,
    Run,
    measured,
    simulate,
    wheels_of,
)
from fulmar_benchmarks.workers import mapped
from fulmar_core.estimators.inertia.batch import batch_fit
from fulmar_core.estimators.inertia.ekf import EkfSettings, InertiaFilter
from fulmar_core.estimators.inertia.recursive import RecursiveFit
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks.torque_profiles import GAINS, OWN, PROFILES

SATELLITES = tuple(GAINS)
METHODS = ("ls", "rls", "ekf")
GUESS = {
    "cubesat_wheels": 0.8
}  # factor on the true inertia to begin with; others 0.85: public code of the study
CHANGES = ("step", "drift", "periodic")
SETTLED_S = 60.0  # after which errors of a changing inertia count
FOUND, IN_S, KNOWN = (
    0.03,
    60.0,
    0.02,
)  # a step is found to this share in this time; share that counts as observable

Progress = Callable[[float, float], None]


@dataclass(frozen=True)
class Request:
    """What to measure."""

    satellites: tuple[str, ...]
    profiles: tuple[str, ...]
    draws: int  # of sensor noise, for each cell
    seed: int
    jobs: int


def run_inertia(request: Request, progress: Progress) -> dict[str, Any]:
    """Measure, and put the figures together; JSON-ready, see `fulmar benchmark inertia --help`."""
    items = [(each, request.profiles, change, request.draws, request.seed)
             for each in request.satellites for change in ("static", *CHANGES)]  # fmt: skip
    found = dict(
        zip(
            [item[:3:2] for item in items],
            mapped(_work, items, jobs=request.jobs, progress=progress),
            strict=True,
        )
    )
    static = {each: found[each, "static"] for each in request.satellites}
    return {
        "cells": {
            level: {each: static[each]["levels"][level] for each in request.satellites} for level in LEVELS
        },
        "dynamic": {change: {each: found[each, change] for each in request.satellites} for change in CHANGES},
        "excitation": {each: static[each]["excitation"] for each in request.satellites},
        "draws": request.draws,
        "seed": request.seed,
        "sample_s": SAMPLE_S,
        "wheel_std": WHEEL_STD,
    }


def _work(satellite: str, profiles: Sequence[str], change: str, draws: int, seed: int) -> dict[str, Any]:
    runs = simulate(satellite, profiles, change=change, seed=seed)
    if change == "static":
        return {
            "levels": {
                level: {
                    name: _cell(satellite, run, level, draws, seed + 97 * i)
                    for i, (name, run) in enumerate(runs.items())
                }
                for level in LEVELS
            },
            "excitation": {name: _information(satellite, run) for name, run in runs.items()},
        }
    return {
        name: _changing(satellite, run, change, seed + 97 * i) for i, (name, run) in enumerate(runs.items())
    }


def _cell(satellite: str, run: Run, level: str, draws: int, seed: int) -> dict[str, Any]:
    """Largest relative error of the diagonal after the run, over all draws, by method."""
    inertia, wheels = _facts(satellite)
    worst = dict.fromkeys(METHODS, 0.0)
    for draw in range(draws):
        rate, speeds = measured(run, level, np.random.default_rng((seed, draw)))
        momentum = wheels.spin_inertia * speeds
        ekf, rls = _filters(satellite, level)
        for k, time_s in enumerate(run.times):
            ekf.add(rate[k], momentum[k], float(time_s))
            rls.add(rate[k], momentum[k], float(time_s))
        fits = {
            "ls": batch_fit(rate, momentum, run.times, count=3).numbers,
            "rls": rls.numbers,
            "ekf": ekf.numbers,
        }
        for method, numbers in fits.items():
            worst[method] = max(worst[method], float(np.abs(numbers / inertia - 1.0).max()))
    return {method: {"error_max": worst[method], "saturated": run.saturated} for method in METHODS}


def _changing(satellite: str, run: Run, change: str, seed: int) -> dict[str, Any]:
    """The filter and the batch least squares beside an inertia that changes, with a fine gyroscope."""
    inertia, wheels = _facts(satellite)
    rate, speeds = measured(run, "fine", np.random.default_rng((seed, 0)))
    momentum = wheels.spin_inertia * speeds
    ekf, _ = _filters(satellite, "fine")
    errors, shares = np.zeros(len(run.times)), np.zeros(len(run.times))
    for k, time_s in enumerate(run.times):
        ekf.add(rate[k], momentum[k], float(time_s))
        errors[k] = np.abs(ekf.numbers / (run.growth[k] * inertia) - 1.0).max()
        shares[k] = (np.sqrt(np.diag(ekf.covariance)[:3]) / ekf.numbers[:3]).max()
    fit = batch_fit(rate, momentum, run.times, count=3).numbers
    batch = np.abs(fit / (run.growth[:, None] * inertia) - 1.0).max(axis=1)
    late = run.times >= SETTLED_S
    found: dict[str, Any] = {
        "ekf": float(np.sqrt(np.mean(errors[late] ** 2))),
        "ls": float(np.sqrt(np.mean(batch[late] ** 2))),
        "observable": float(np.mean(shares[late] <= KNOWN)),
        "saturated": run.saturated,
    }
    if change == "step":
        after = np.flatnonzero(run.growth > 1.05)
        off = np.flatnonzero(errors[after] > FOUND)
        found["found_s"] = (
            float(run.times[after[off[-1]]] - run.times[after[0]] + SAMPLE_S) if len(off) else 0.0
        )
        found["found"] = found["found_s"] <= IN_S
        at = after[0] + round(IN_S / SAMPLE_S)
        found["says_it_cannot_observe"] = bool(shares[at] > KNOWN)
    return found


def _filters(satellite: str, level: str) -> tuple[InertiaFilter, RecursiveFit]:
    inertia, wheels = _facts(satellite)
    guess, gyroscope = GUESS.get(satellite, 0.85) * inertia, LEVELS[level][0]
    momentum_std = wheels.spin_inertia * WHEEL_STD
    noise = math.sqrt(2.0) * max(momentum_std, gyroscope * float(inertia.max()))
    return InertiaFilter(guess, EkfSettings(gyroscope, momentum_std)), RecursiveFit(
        guess, spread=0.3, noise=noise
    )


def _information(satellite: str, run: Run) -> dict[str, float]:
    """D-criterion of a profile: the root of the determinant of the information about shares of the inertia, a second.

    Of the six numbers (`full`) and of the moments alone (`diagonal`), per squared N·m·s of a balance's noise.
    """
    inertia, wheels = _facts(satellite)
    momentum = wheels.spin_inertia * run.speeds
    unit = np.append(inertia, np.full(3, inertia.mean()))
    found = {}
    for name, count in (("diagonal", 3), ("full", 6)):
        information = batch_fit(run.rate, momentum, run.times, count=count).information
        scaled = information * np.outer(unit[:count], unit[:count]) / run.times[-1]
        sign, logarithm = np.linalg.slogdet(scaled)
        found[name] = float(np.exp(logarithm / count)) if sign > 0 else 0.0
    return found


def _facts(satellite: str) -> tuple[np.ndarray, ReactionWheels]:
    robot = load_robot(satellite)
    return np.array(robot.body.inertia[:3]), wheels_of(robot)


def requirements(document: dict[str, Any]) -> list[tuple[str, str, bool]]:
    """What the benchmark is to show: a name, what was measured, and whether it is enough."""
    found = []
    cells = document["cells"]

    def errors(level: str, method: str) -> list[float]:
        return [
            cell[method]["error_max"]
            for satellite in cells[level].values()
            for name, cell in satellite.items()
            if name != OWN
        ]

    for level, limit, spare in (("fine", 0.001, 0), ("low_cost", 0.01, 2)):
        every = errors(level, "ls")
        good = sum(error <= limit for error in every)
        name = f"least squares, {level}, within {100 * limit:g} %"
        found.append(
            (name, f"{good} of {len(every)}, worst {100 * max(every):.4f} %", good >= len(every) - spare)
        )
    every = errors("fine", "ekf")
    good = sum(error <= 0.02 for error in every)
    found.append(
        (
            "EKF, fine, within 2 %",
            f"{good} of {len(every)}, worst {100 * max(every):.3f} %",
            good >= len(every) - 4,
        )
    )
    steps = [cell for satellite in document["dynamic"]["step"].values() for cell in satellite.values()]
    right = sum(cell["found"] or cell["says_it_cannot_observe"] for cell in steps)
    found.append(
        ("step of 10 % found in 60 s to 3 %, or said to be unobservable",
         f"{sum(cell['found'] for cell in steps)} found, {right} of {len(steps)} right", right == len(steps))
    )  # fmt: skip
    for change in ("drift", "periodic"):
        runs = [cell for satellite in document["dynamic"][change].values() for cell in satellite.values()]
        seen = [cell for cell in runs if cell["observable"] >= 0.5]
        ratio = float(np.median([cell["ekf"] / cell["ls"] for cell in seen])) if seen else math.inf
        text = f"median {ratio:.2f} over {len(seen)} of {len(runs)} runs in which it is observable most of the time"
        found.append((f"{change}: error of the EKF over that of the batch", text, ratio <= 0.5))
    return found


__all__ = ["METHODS", "PROFILES", "SATELLITES", "Request", "requirements", "run_inertia"]
