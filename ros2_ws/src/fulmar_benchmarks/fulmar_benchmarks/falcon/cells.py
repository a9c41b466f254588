"""One cell of the benchmark: some flights of a craft by one controller in one scenario, and their figures."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_benchmarks.falcon.published import BESIDE
from fulmar_benchmarks.pairs import policy_hash
from fulmar_benchmarks.shape import Cell, Figures, Progress
from fulmar_core.controllers.by_kind import LAWS
from fulmar_core.controllers.classical import gains_of
from fulmar_core.controllers.controller import Controller
from fulmar_core.loop.rollout import roll_out_in_batch
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.flight_figures import flight_figures
from fulmar_core.simulation.trajectories import Trajectories
from fulmar_core.tasks import load_task
from fulmar_core.tasks.references.flight_paths import PATHS
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


@dataclass(frozen=True, kw_only=True)
class FalconCell(Cell):
    """What one cell flies."""

    modules = (f"{__package__}.published",)

    robot: str
    task: str
    controller: str
    scenario: str
    episodes: int
    seed: int
    policy: str = ""  # folder of a bundle; empty: the shipped one

    def parts(self) -> dict[str, Any]:
        """A bundle counts by what is in it, not by where it lies."""
        policy = policy_hash(self.robot, f"fly_{self.task}", self.controller, self.policy)
        return {**super().parts(), "policy": policy}

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """Figures, and the first flight as it is drawn."""
        found, flight = fly(self)
        return {"figures": found, "flight": flight}


def falcon_cell(
    robot: str, task: str, by: str, scenario: str, episodes: int, seed: int, policy: str = ""
) -> FalconCell:
    """A cell with its name; each flight of MPPI has rollouts of its own."""
    return FalconCell(
        name=f"{robot}_{task}_{by}_{scenario}", cost=episodes * (20.0 if by == "mppi" else 1.0), robot=robot,
        task=task, controller=by, scenario=scenario, episodes=episodes, seed=seed, policy=policy,
    )  # fmt: skip


def controller_of(robot: Robot, cell: FalconCell) -> Controller:
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


def fly(cell: FalconCell) -> tuple[dict[str, Any], dict[str, Any]]:
    """Fly a cell; its figures, JSON-ready, see `fulmar benchmark falcon --help`, and its `first_flight`."""
    robot, task = load_robot(cell.robot), load_task(f"fly_{cell.task}")
    controller = controller_of(robot, cell)
    begun = time.perf_counter()
    run = roll_out_in_batch(
        controller, robot, task, SCENARIOS[cell.scenario], episodes=cell.episodes, seed=cell.seed
    )
    found = flight_figures(run, cell.task, robot) | {"wall_s": time.perf_counter() - begun}
    published = BESIDE.get(cell.controller, {}).get(cell.task)
    return found | {"thesis": published.as_json() if published else {}}, first_flight(run, robot)


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
