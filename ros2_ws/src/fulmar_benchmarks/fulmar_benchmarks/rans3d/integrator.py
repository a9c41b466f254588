"""How well the step of batch and nodes keeps a torque-free tumble of an asymmetric body, in both precisions."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, wait
from dataclasses import asdict
from multiprocessing import get_context
from typing import Any

import numpy as np

from fulmar_benchmarks.mujoco_pace import INTEGRATORS
from fulmar_benchmarks.rans3d.mujoco_tumble import MOST_S, mujoco_drift
from fulmar_benchmarks.workers import begin_worker, counted, ended_with_us, one_thread_each
from fulmar_core.dynamics.tumble import AXIS, MOMENTS, RATE, Drift, drift_over, measured_order
from fulmar_core.robots.robot import Robot

METHOD = "Runge-Kutta for the turn rate, Magnus expansion for the attitude"
TYPES = {"float64": np.float64, "float32": np.float32}


def measure_integrator(
    robots: Sequence[Robot], seconds: float, *, jobs: int, progress: Callable[[float, float], None]
) -> dict[str, Any]:
    """Let the body tumble at the step of each robot.

    Args:
        robots: Robots in space; only their integration steps matter.
        seconds: Length of the tumble [s].
        jobs: Processes at once.
        progress: Called with how much is done, and of how much.

    Returns:
        JSON-ready: method, order and body; by robot the `step_s`, and in each precision the largest relative drifts
        `energy`, `momentum` and `from_jacobi`. Under `mujoco` the same of MuJoCo's methods in float64, at the step of
        the first robot, for ten minutes at most.
    """
    spawn = get_context("spawn")
    work = [(robot.timing.physics_dt, name) for robot in robots for name in TYPES]
    counts = spawn.Array("q", len(work), lock=False)
    with (
        one_thread_each(),
        ended_with_us(ProcessPoolExecutor(jobs, spawn, begin_worker, (counts, os.getpid()))) as pool,
    ):
        futures = [pool.submit(_drift, seconds, *each, i) for i, each in enumerate(work)]
        while wait(futures, timeout=0.5).not_done:
            progress(float(sum(counts)), seconds * len(work))
        drifts = [asdict(future.result()) for future in futures]
    of_each = iter(drifts)
    return {
        "method": METHOD,
        "order": measured_order(),
        "moments_kg_m2": list(MOMENTS),
        "rate_rad_s": RATE,
        "axis": list(AXIS),
        "seconds": seconds,
        "mujoco": {
            "step_s": robots[0].timing.physics_dt,
            "seconds": min(seconds, MOST_S),
            **{
                name: asdict(mujoco_drift(name, seconds, robots[0].timing.physics_dt)) for name in INTEGRATORS
            },
        },
        "robots": {
            robot.name: {"step_s": robot.timing.physics_dt, **{name: next(of_each) for name in TYPES}}
            for robot in robots
        },
    }


def _drift(seconds: float, dt: float, precision: str, index: int) -> Drift:
    report = counted(index)
    return drift_over(seconds, dt, TYPES[precision], lambda done: report(int(done)))
