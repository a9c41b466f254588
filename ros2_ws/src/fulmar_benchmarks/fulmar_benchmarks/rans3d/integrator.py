"""How well the step of batch and nodes keeps a torque-free tumble of an asymmetric body, in both precisions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from fulmar_benchmarks.mujoco_pace import INTEGRATORS
from fulmar_benchmarks.rans3d.mujoco_tumble import MOST_S, mujoco_drift
from fulmar_benchmarks.shape import Cell, Figures, Found, Progress, known
from fulmar_core.dynamics.tumble import AXIS, MOMENTS, RATE, drift_over, measured_order
from fulmar_core.robots.robot_file import load_robot

METHOD = "Runge-Kutta for the turn rate, Magnus expansion for the attitude"
COST = 1e4  # of a second of the tumble, in steps of a batch
TYPES = {"float64": np.float64, "float32": np.float32}


@dataclass(frozen=True, kw_only=True)
class TumbleCell(Cell):
    """One tumble at the step of a robot, by our step in one precision, or by one of MuJoCo's methods."""

    modules = tuple(f"fulmar_benchmarks.{name}" for name in ("rans3d.mujoco_tumble", "mujoco_pace"))
    robot: str
    how: str  # of TYPES, or of MuJoCo's INTEGRATORS
    seconds: float

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """Largest relative drifts."""
        dt = load_robot(self.robot).timing.physics_dt
        if self.how not in TYPES:
            return asdict(mujoco_drift(self.how, self.seconds, dt))
        return asdict(drift_over(self.seconds, dt, TYPES[self.how], lambda done: progress(COST * done)))


def tumbles(robots: Sequence[str], seconds: float) -> list[TumbleCell]:
    """Each robot in both precisions, and MuJoCo at the step of the first."""
    every = [(robot, how) for robot in robots for how in TYPES] + [(robots[0], how) for how in INTEGRATORS]
    return [
        TumbleCell(
            name=f"tumble_{robot}_{how}",
            cost=COST * seconds,
            way="mujoco",
            robot=robot,
            how=how,
            seconds=seconds,
        )
        for robot, how in every
    ]


def integrator_of(robots: Sequence[str], seconds: float, found: Found) -> dict[str, Any]:
    """What came of `tumbles`.

    Returns:
        JSON-ready: method, order and body; by robot the `step_s`, and in each precision the largest relative drifts
        `energy`, `momentum` and `from_jacobi`. Under `mujoco` the same of MuJoCo's methods in float64, at the step of
        the first robot, for ten minutes at most.
    """
    steps = {robot: load_robot(robot).timing.physics_dt for robot in robots}
    mujoco = {how: known(found, f"tumble_{robots[0]}_{how}") for how in INTEGRATORS}
    return {
        "method": METHOD,
        "order": measured_order(),
        "moments_kg_m2": list(MOMENTS),
        "rate_rad_s": RATE,
        "axis": list(AXIS),
        "seconds": seconds,
        "mujoco": {"step_s": steps[robots[0]], "seconds": min(seconds, MOST_S), **mujoco},
        "robots": {
            robot: {"step_s": step, **{how: known(found, f"tumble_{robot}_{how}") for how in TYPES}}
            for robot, step in steps.items()
        },
    }
