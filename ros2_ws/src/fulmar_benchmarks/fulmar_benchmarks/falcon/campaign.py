"""The whole benchmark of FALCON-S: every task by every controller in every scenario, and ground effect over height."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_benchmarks.falcon.cells import RANDOM, SCENARIOS, Cell, fly
from fulmar_benchmarks.workers import mapped
from fulmar_core.config.errors import ConfigError, FulmarError
from fulmar_core.dynamics.flight_trim import Trim, find_trim
from fulmar_core.robots.airframe.ground_effect import induced_drag_ratio, lift_ratio
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from policy_server.controllers import shipped_policy

Progress = Callable[[float, float], None]
HEIGHTS_M = (1.0, 2.5, 5.0, 10.0, 100.0)  # of thesis Table 5.2
THESIS_ENERGY = (0.303, 0.590, 0.689, 0.723, 0.743)  # same
HALF = 0.5  # of the thesis' RMSE, which exact state must stay below
WITH_SENSORS = {"a": 0.03, "d": 0.03, "e": 0.03}  # limits with sensors; elsewhere the thesis' own [m]
MPPI_LIMIT = {"a": 0.03, "d": 0.03, "e": 0.03}  # of MPPI with exact state [m]
# Scenarios that controllers fly where none are named; one that is left out flies them all.
USUAL = {**dict.fromkeys(("lqr", "pid"), ("exact", "calm", "light", "severe")), "mppi": ("exact",)}
DRAWN = "calm"  # scenario whose flights the report draws, where it is flown
SEEDS = 5  # of a controller that draws, with exact state
HOLD = "hold"  # the task whose flights begin at different heights
STEADY = (HOLD, "a", "d", "e", "f")  # tasks that must survive noise, delay and light turbulence
SURVIVAL = 0.95
# Of a policy that holds a height: altitude RMSE with the start and after 10 s [m], and survival, by scenario.
POLICY_LIMITS = {"calm": (0.12, 0.04, 0.99), "light": (0.20, None, 0.97)}


@dataclass(frozen=True)
class Request:
    """What to fly."""

    robot: str
    tasks: tuple[str, ...]
    controllers: tuple[str, ...]
    scenarios: tuple[str, ...]  # empty: the usual ones of each controller
    episodes: int
    seed: int
    jobs: int
    policy: str = ""  # folder of a bundle; empty: the shipped ones


Flights = dict[str, dict[str, dict[str, Any]]]  # by task and controller, as in `cells.first_flight`


def run_falcon(request: Request, progress: Progress) -> tuple[dict[str, Any], Flights]:
    """Fly every cell; all figures, JSON-ready, and a flight of each task by each controller, in calm if flown."""
    cells = cells_of(request)
    flown = mapped(_fly, [(cell,) for cell in cells], jobs=request.jobs, progress=progress)
    tasks: dict[str, Any] = {}
    flights: Flights = {}
    for cell, (figures, flight) in zip(cells, flown, strict=True):
        tasks.setdefault(cell.task, {}).setdefault(cell.controller, {})[cell.scenario] = figures
        if flight and (cell.scenario == DRAWN or cell.controller not in flights.get(cell.task, {})):
            flights.setdefault(cell.task, {})[cell.controller] = flight | {"scenario": cell.scenario}
    document = {
        "robot": request.robot,
        "seed": request.seed,
        "episodes": request.episodes,
        "tasks": tasks,
        "ground_effect": ground_effect(request.robot),
    }
    return document, flights


def cells_of(request: Request) -> list[Cell]:
    """What is flown, in its order; of policies only those that are shipped."""
    return [
        Cell(
            request.robot,
            task,
            controller,
            scenario,
            _episodes(request, task, controller, scenario),
            request.seed,
            request.policy,
        )
        for task in request.tasks
        for controller in request.controllers
        for scenario in request.scenarios or USUAL.get(controller, tuple(SCENARIOS))
        if controller != "policy"
        or request.policy
        or shipped_policy(request.robot, f"fly_{task}") is not None
    ]


def _episodes(request: Request, task: str, controller: str, scenario: str) -> int:
    """Flights of a cell; with exact state those along a path of a controller that draws nothing are all alike."""
    if scenario != "exact" or task == HOLD:
        return request.episodes
    return min(request.episodes, SEEDS) if controller in RANDOM else 1


def _fly(cell: Cell) -> tuple[dict[str, Any], dict[str, Any]]:
    try:
        return fly(cell)
    except FulmarError as error:
        return {"error": str(error), "survival": None, "episodes": 0}, {}


def ground_effect(name: str) -> dict[str, Any]:
    """Trim over height beside thesis Table 5.2, and the ratios of thesis Fig. 5.1."""
    robot = load_robot(name)
    frame = robot.airframe
    assert frame is not None  # of an aircraft
    trims = [find_trim(robot, frame.speed, height) for height in HEIGHTS_M]
    over_span = np.geomspace(0.1, 3.0, 40)
    best = _least_energy(robot, frame.speed)
    return {
        "heights_m": list(HEIGHTS_M),
        "energy": [trim.throttle**2 for trim in trims],
        "thrust_n": [trim.thrust for trim in trims],
        "thesis_energy": list(THESIS_ENERGY),
        "energy_per_m": trims[0].throttle ** 2 / frame.speed,
        "least_energy_per_m": best.throttle**2 / best.speed,
        "least_energy_speed": best.speed,
        "height_over_span": over_span.tolist(),
        "lift_ratio": lift_ratio(over_span, frame.aspect_ratio, frame.taper).tolist(),
        "induced_drag_ratio": induced_drag_ratio(over_span, frame.aspect_ratio, frame.taper).tolist(),
    }


def _least_energy(robot: Robot, speed: float) -> Trim:
    """Trim at the first of `HEIGHTS_M`, near a speed [m/s], whose squared throttle over the speed is least."""
    trims = []
    for share in np.linspace(0.8, 1.2, 41):
        with contextlib.suppress(ConfigError):  # there is no level flight as slow as that
            trims.append(find_trim(robot, share * speed, HEIGHTS_M[0]))
    return min(trims, key=lambda trim: float(trim.throttle**2 / trim.speed))


def requirements(document: dict[str, Any]) -> list[tuple[str, str, str, bool]]:
    """What is required, what was asked and found, and whether it is met; of what was flown."""
    rows = []
    for task, controllers in document["tasks"].items():
        if task in MPPI_LIMIT and "exact" in controllers.get("mppi", {}):
            rows.append(_mppi_row(task, controllers["mppi"]["exact"]))
        for scenario, found in controllers.get("lqi", {}).items():
            rmse, thesis = found.get("rmse_per_axis_m"), found.get("thesis", {}).get("rmse_per_axis_m")
            limit = None
            if thesis and scenario == "exact":
                limit = HALF * thesis
            elif thesis and scenario == "calm":
                limit = WITH_SENSORS.get(task, thesis)
            if limit is not None:
                good = rmse is not None and rmse <= limit and found["survival"] == 1.0
                shown = "crashed" if rmse is None else f"{rmse:.4f} m"
                rows.append((f"LQI, ({task}), {scenario}: RMSE per axis", f"<= {limit:.4f} m", shown, good))
            if scenario in ("noise", "delay", "late", "light") and task in STEADY:
                rows.append(_survival_row(f"LQI, {task}, {scenario}", found["survival"], SURVIVAL))
        if task == HOLD:
            rows += _policy_rows(controllers.get("policy", {}))
    return rows


def _policy_rows(scenarios: dict[str, Any]) -> list[tuple[str, str, str, bool]]:
    rows = []
    for scenario, (whole, late, survival) in POLICY_LIMITS.items():
        if scenario not in scenarios:
            continue
        found = scenarios[scenario]
        about = f"policy, hold, {scenario}, {found['episodes']} flights"
        rows.append(_survival_row(about, found["survival"], survival))
        for name, what, limit in (
            ("altitude_rmse_m", "altitude RMSE", whole),
            ("late_altitude_rmse_m", "same after 10 s", late),
        ):
            if limit is not None:
                rmse = found.get(name)
                shown = "crashed" if rmse is None else f"{rmse:.4f} m"
                rows.append(
                    (f"{about}: {what}", f"<= {limit:g} m", shown, rmse is not None and rmse <= limit)
                )
    return rows


def _survival_row(about: str, alive: float | None, least: float) -> tuple[str, str, str, bool]:
    """Share of flights that must survive; None: they could not be flown."""
    shown = "not flown" if alive is None else f"{alive:.3f}"
    return f"{about}: survival", f">= {least:g}", shown, alive is not None and alive >= least


def _mppi_row(task: str, found: dict[str, Any]) -> tuple[str, str, str, bool]:
    worst, limit = found.get("rmse_per_axis_worst_m"), MPPI_LIMIT[task]
    alive = found["survival"] == 1.0
    shown = f"{worst:.4f} m" if worst is not None and alive else "crashed"
    what = f"MPPI, ({task}), exact, {found['episodes']} seeds: largest RMSE per axis"
    return what, f"<= {limit:.4f} m", shown, worst is not None and worst <= limit and alive
