"""The tumble of `fulmar_core.dynamics.tumble` by MuJoCo's own methods: drifts of its rollout at a time step."""

from __future__ import annotations

import mujoco
import numpy as np

from fulmar_benchmarks.mujoco_pace import INTEGRATORS
from fulmar_core.dynamics.tumble import (
    CHECK_S,
    MASS,
    MOMENTS,
    RATE,
    Drift,
    asymmetric_body,
    drifts,
    jacobi_rate,
    tumbling,
)
from fulmar_core.states.spatial import SpatialState

MOST_S = 600.0  # Euler's method diverges within an hour at the spacecraft's step, with warnings on stderr [s]


def mujoco_drift(integrator: str, seconds: float, dt: float) -> Drift:
    """The largest drifts of the tumble in MuJoCo, looked at every minute and in the end.

    Args:
        integrator: One of `INTEGRATORS`.
        seconds: How long, at most `MOST_S` [s].
        dt: Time step [s].
    """
    model = _model(integrator, dt)
    data = mujoco.MjData(model)
    start, body = tumbling(), asymmetric_body()
    data.qvel[3:] = start.rate
    found, time_s, seconds = np.zeros(3), 0.0, min(seconds, MOST_S)
    while time_s < seconds - 0.5 * dt:
        count = max(1, round(min(CHECK_S, seconds - time_s) / dt))
        mujoco.mj_step(model, data, count)
        time_s += count * dt
        w, x, y, z = data.qpos[3:]
        now = SpatialState(*np.concatenate((data.qpos[:3], (x, y, z, w), data.qvel)))
        away = np.linalg.norm(np.array(now.rate) - jacobi_rate(start.rate, time_s)) / RATE
        found = np.maximum(found, np.array((*drifts(start, now, body), float(away))))
    return Drift(*(float(value) for value in found))


def _model(integrator: str, dt: float) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.integrator = dt, INTEGRATORS[integrator]
    spec.option.gravity = [0.0, 0.0, 0.0]
    body = spec.worldbody.add_body()
    body.add_freejoint()
    body.mass, body.inertia, body.explicitinertial = MASS, list(MOMENTS), True
    return spec.compile()
