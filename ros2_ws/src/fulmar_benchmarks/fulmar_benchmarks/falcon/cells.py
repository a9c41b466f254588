"""One cell of the benchmark: some flights of a craft by one controller in one scenario, and their figures."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_benchmarks.falcon.published import BESIDE
from fulmar_core.controllers.by_kind import LAWS
from fulmar_core.controllers.classical import gains_of
from fulmar_core.controllers.controller import Controller
from fulmar_core.loop.rollout import roll_out_in_batch
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.trajectories import Trajectories
from fulmar_core.tasks import load_task
from fulmar_core.tasks.references.flight_paths import PATHS, Profile
from fulmar_core.worlds.parts import Actuation, Air, Sensing
from fulmar_core.worlds.scenario import Scenario
from fulmar_core.worlds.turbulence import CLASSES
from policy_server.controllers import Choice, load_controller, usual_hz

TASKS = ("hold", *PATHS)
CONTROLLERS = ("lqi", "lqr", "mppi", "pid", "policy")
# Controllers that draw: flights with exact state differ by their seeds.
FLIGHT_LAWS = LAWS["aircraft"]["control_surfaces"]
RANDOM = tuple(name for name, entry in FLIGHT_LAWS.items() if entry.draws)
LATE_S = 0.02  # delay of measurements in `delay` and `all`, of commands in `late`
NOISY = 2.0  # times the noise of the sensors: the mild row of FALCON-S
SETTLED_M = 0.1  # a flight has settled once it stays so near to its reference
WITHOUT_START_S = 10.0  # after which `late_altitude_rmse_m` counts
PLOTTED_S = 0.2  # between points of a flight that is drawn


def _scenario(name: str, **parts: Any) -> Scenario:
    return Scenario(name, sensor_noise=name != "exact", body="nominal", **parts)


SCENARIOS = {
    "exact": _scenario("exact"),
    "calm": _scenario("calm"),
    "noise": _scenario("noise", sensing=Sensing(noise=NOISY)),
    "delay": _scenario("delay", sensing=Sensing(delay_s=LATE_S, least_delay=1.0)),
    "late": _scenario("late", actuation=Actuation(delay_s=LATE_S, least_delay=1.0)),
    "light": _scenario("light", air=Air(turbulence=CLASSES["light"])),
    "severe": _scenario("severe", air=Air(turbulence=CLASSES["severe"])),
    "all": _scenario(
        "all",
        sensing=Sensing(noise=NOISY, delay_s=LATE_S, least_delay=1.0),
        air=Air(turbulence=CLASSES["light"]),
    ),
}


@dataclass(frozen=True)
class Cell:
    """What one cell flies."""

    robot: str
    task: str
    controller: str
    scenario: str
    episodes: int
    seed: int
    policy: str = ""  # folder of a bundle; empty: the shipped one


def controller_of(robot: Robot, cell: Cell) -> Controller:
    """The controller of a cell; with exact state the laws take it as it is, without their filter.

    Raises:
        FulmarError: There is none, such as no shipped policy for the task.
    """
    task = load_task(f"fly_{cell.task}")
    if cell.controller == "policy":
        rate = usual_hz("policy", robot, task, Path(cell.policy) if cell.policy else None)
        return load_controller("policy", robot, task, Choice(rate, policy=cell.policy))
    gains = gains_of(robot, cell.controller)
    if cell.scenario == "exact":
        gains = replace(gains, observer=None)
    law = FLIGHT_LAWS[cell.controller].law(robot, task, gains, name=cell.controller)
    if cell.controller in RANDOM:
        law.seeds = tuple(range(cell.seed, cell.seed + cell.episodes))
    return law


def reference(task: str) -> tuple[Profile, Profile]:
    """Place to the left and height [m] over time [s] of what a task follows."""
    return PATHS.get(task, (lambda t: 0.0 * t, lambda t: 1.0 + 0.0 * t))


def fly(cell: Cell) -> tuple[dict[str, Any], dict[str, Any]]:
    """Fly a cell; its figures, JSON-ready, see `fulmar benchmark falcon --help`, and its `first_flight`."""
    robot, task = load_robot(cell.robot), load_task(f"fly_{cell.task}")
    controller = controller_of(robot, cell)
    begun = time.perf_counter()
    run = roll_out_in_batch(
        controller, robot, task, SCENARIOS[cell.scenario], episodes=cell.episodes, seed=cell.seed
    )
    found = figures(run, cell.task, robot) | {"wall_s": time.perf_counter() - begun}
    published = BESIDE.get(cell.controller, {}).get(cell.task)
    return found | {"thesis": published.as_json() if published else {}}, first_flight(run, robot)


def figures(run: Trajectories, task: str, robot: Robot) -> dict[str, Any]:
    """Figures of some flights: medians over those that survive, and the share that does.

    Altitude RMSE is over all flights that survive together. Energy is the mean squared throttle [-]; added up over
    time, per metre, it is `energy_per_m` [s/m].
    Per axis and over all: √(mean ‖e‖² / 3) and √(mean ‖e‖²) of the way to the reference, of which that ahead is 0.
    """
    error = np.asarray(run.position_error, dtype=float)
    times = run.control_dt * np.arange(1, error.shape[1] + 1)
    off = np.asarray(run.z, dtype=float) - reference(task)[1](times)
    alive = ~np.any(run.touching, axis=1)
    rmse = np.sqrt(np.mean(error**2, axis=1))
    throttles = np.asarray(run.shares)[..., robot.actuators.positions :]
    near = np.flip(np.logical_and.accumulate(np.flip(error <= SETTLED_M, axis=1), axis=1), axis=1)
    settled = np.where(near.any(axis=1), np.argmax(near, axis=1) * run.control_dt, np.inf)
    late = times > WITHOUT_START_S

    def pooled(squares: np.ndarray) -> float | None:
        return float(np.sqrt(np.mean(squares[alive]))) if alive.any() and squares.size else None

    def median(values: np.ndarray) -> float | None:
        middle = float(np.median(values[alive])) if alive.any() else math.inf
        return middle if math.isfinite(middle) else None

    peak = median(error.max(axis=1))
    return {
        "rmse_per_axis_m": median(rmse / np.sqrt(3.0)),
        "rmse_per_axis_worst_m": float(rmse[alive].max() / np.sqrt(3.0)) if alive.any() else None,
        "rmse_m": median(rmse),
        "altitude_rmse_m": pooled(off**2),
        "late_altitude_rmse_m": pooled(off[:, late] ** 2),
        "settling_s": median(settled),
        "peak_error_m": peak,
        "overshoot_m": peak,  # as the thesis calls it
        "energy": median(np.mean(throttles**2, axis=(1, 2))),
        "energy_per_m": median(np.mean(throttles**2, axis=(1, 2)) / np.mean(run.speed, axis=1)),
        "survival": float(np.mean(alive)),
        "episodes": len(alive),
    }


def first_flight(run: Trajectories, robot: Robot) -> dict[str, Any]:
    """The first of some flights until it is lost, every `PLOTTED_S`.

    Returns:
        `time_s`, `height_m`, `left_m`, `energy_s` (mean squared throttle, added up over time), and `surfaces_deg` by
        name; arrays of equal length.
    """
    every = max(1, round(PLOTTED_S / run.control_dt))
    flown = int(np.argmax(run.touching[0])) if run.touching[0].any() else run.touching.shape[1]
    count, limits = robot.actuators.positions, np.degrees(robot.actuators.scale)
    shares = run.shares[0, :flown]
    energy = np.cumsum(np.mean(np.square(shares[:, count:]), axis=1)) * run.control_dt
    picked = slice(0, flown, every)
    return {
        "time_s": run.control_dt * np.arange(1, flown + 1)[picked],
        "height_m": np.asarray(run.z)[0, picked],
        "left_m": run.y[0, picked],
        "energy_s": energy[picked],
        "surfaces_deg": {
            name: shares[picked, i] * limits[i] for i, name in enumerate(robot.actuators.names[:count])
        },
    }
