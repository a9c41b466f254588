"""What recording costs the control loop: latency with a recorder and without one, in turns, in one run.

The plant runs here, as `fulmar run` has it, on its own deadlines; its controller is a process of its own. At four times
real time its odometry comes 200 times a second and the commands that answer it 50 times. Without a recorder there is
none: the process is started for each stretch that is recorded, and what it costs to start does not count.

What counts is the median of the ratios of neighbouring stretches: on a machine that others use, one bad stretch decides
the 99th percentile of all of them together.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rclpy.lifecycle import TransitionCallbackReturn

from fulmar_bringup.domains import own_domain
from fulmar_bringup.processes import ProcessGroup, command_line
from fulmar_bringup.readiness import while_starting
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.supervisor import Supervisor, supervisor
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import SIMULATION_START_NS
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from fulmar_ros.deadline import Spread
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.runtime import settle_memory, spinning
from sim_nodes.sim_node import make_backend
from tests.benchmarks.recorder.recorders import recorders

ODOMETRY_HZ, COMMAND_HZ = 200.0, 50.0
ALLOWED = 1.05  # 99th percentile with a recorder, as a multiple of the one without
SETTLE_S = 2.0  # after a recorder came or went, and no longer than a stretch
RESAMPLED = 2000
TURNS = (True, False, False, True)  # drift of the machine falls on both alike


def cost_of_recording(
    plan: RunPlan, *, stretches: int, stretch_s: float, out: Path, progress: Callable[[], None]
) -> dict[str, Any]:
    """Measure.

    Args:
        plan: Robot and task; its rates are set here.
        stretches: With a recorder, and as many without, >= 1.
        stretch_s: Length of each [s].
        out: Folder of the bags.
        progress: Called after each stretch.

    Returns:
        Figures by name, ready for JSON.

    Raises:
        RunFailed: The nodes do not get ready.
    """
    physics_hz = 1.0 / load_robot(plan.robot).timing.physics_dt
    rate = ODOMETRY_HZ / physics_hz
    plan = replace(plan, rate=rate, control_hz=COMMAND_HZ / rate, supervised=True)
    measured: dict[bool, list[np.ndarray]] = {True: [], False: []}
    with own_domain(), _running(plan) as plant:
        for number in range(2 * stretches):
            recorded = TURNS[number % len(TURNS)]
            bags = {out / f"cost_{number}": plan} if recorded else {}
            with recorders(bags) as started:
                time.sleep(min(SETTLE_S, stretch_s))
                plant.wires.commands.latency_ms = Spread()
                time.sleep(stretch_s)
                measured[recorded].append(with_missing(plant.wires.commands.latency_ms.values(), stretch_s))
                for recorder in started:
                    recorder.stop()
            progress()
    return _figures(measured)


@contextlib.contextmanager
def _running(plan: RunPlan) -> Iterator[PlantNode]:
    """A plant in this process and its controller, at work until the context ends."""
    group = ProcessGroup()
    try:
        rows = system_rows(plan)
        group.start(rows["controller"])
        with supervisor(plan) as overseer:
            plant = PlantNode(make_backend, lambda _code: None, cli_args=command_line(rows["plant"])[3:])
            if plant.trigger_configure() != TransitionCallbackReturn.SUCCESS:
                raise RunFailed("the plant could not be configured")
            with spinning(plant, overseer.fail):
                _begin(plan, plant, overseer, group)
                try:
                    yield plant
                finally:
                    plant.stop()
    finally:
        group.stop_all()


def _begin(plan: RunPlan, plant: PlantNode, overseer: Supervisor, group: ProcessGroup) -> None:
    """Give a goal, then start the plant."""
    alive = while_starting(group, overseer)
    episode = draw_episode(
        load_robot(plan.robot), load_task(plan.task), load_scenario(plan.scenario), seed=plan.seed, number=0
    )
    overseer.give_goal(episode.goal, time_ns=SIMULATION_START_NS, alive=alive)
    settle_memory()
    if plant.trigger_activate() != TransitionCallbackReturn.SUCCESS:
        raise RunFailed("the plant could not be activated")
    overseer.wait_until(lambda: overseer.controller.values.get("mode") == "active", alive)


def _figures(measured: dict[bool, list[np.ndarray]]) -> dict[str, Any]:
    ratio = _p99(measured[True]) / _p99(measured[False])
    low, high = _interval(measured)
    pairs = np.array([_p99([a]) / _p99([b]) for a, b in zip(measured[True], measured[False], strict=True)])
    return {
        "odometry_hz": ODOMETRY_HZ,
        "command_hz": COMMAND_HZ,
        "recorded": _spread(measured[True]),
        "not_recorded": _spread(measured[False]),
        "p99_ratio": ratio,
        "p99_ratio_95": [low, high],
        "p99_ratio_of_pairs": pairs.tolist(),
        "p99_ratio_of_pairs_median": float(np.median(pairs)),
        "p99_ratio_of_pairs_median_95": list(_interval_of_median(pairs)),
        "allowed": ALLOWED,
        "passed": bool(np.median(pairs) <= ALLOWED),
    }


def with_missing(latencies_ms: np.ndarray, stretch_s: float) -> np.ndarray:
    """Latencies of a stretch; commands that the plant refused, or that never came, are as late as it is long.

    Without them a loop that stalls would look the better for it.

    Args:
        latencies_ms: Of the commands that were taken, shape (n,) [ms].
        stretch_s: Length of the stretch [s].

    Returns:
        One for each command that is due, at least, shape (m,) [ms].
    """
    missing = max(0, round(stretch_s * COMMAND_HZ) - len(latencies_ms))
    return np.append(latencies_ms, np.full(missing, 1e3 * stretch_s))


def _spread(stretches: list[np.ndarray]) -> dict[str, float]:
    values = np.concatenate(stretches)
    p50, p99 = np.percentile(values, (50, 99))
    return {
        "commands": len(values),
        "p50_ms": float(p50),
        "p99_ms": float(p99),
        "max_ms": float(values.max()),
    }


def _p99(stretches: list[np.ndarray]) -> float:
    return float(np.percentile(np.concatenate(stretches), 99))


def _interval(measured: dict[bool, list[np.ndarray]]) -> tuple[float, float]:
    """95 % interval of the ratio, from stretches drawn again and again: samples of one stretch hang together."""
    rng = np.random.default_rng(1)

    def drawn(recorded: bool) -> float:
        stretches = measured[recorded]
        return _p99([stretches[i] for i in rng.integers(0, len(stretches), len(stretches))])

    ratios = [drawn(True) / drawn(False) for _ in range(RESAMPLED)]
    low, high = np.percentile(ratios, (2.5, 97.5))
    return float(low), float(high)


def _interval_of_median(values: np.ndarray) -> tuple[float, float]:
    """95 % interval of a median, from the values drawn again and again."""
    drawn = np.random.default_rng(1).choice(values, (RESAMPLED, len(values)))
    low, high = np.percentile(np.median(drawn, axis=1), (2.5, 97.5))
    return float(low), float(high)
