"""The same dynamics in NumPy and torch, batched, float64 and float32."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.dynamics.rigid_body import Disturbance, MassProperties, step
from fulmar_core.robot import load_robot
from fulmar_core.state import RigidBodyState

torch = pytest.importorskip("torch")

ROBOT = load_robot("floating_platform")
N = 64


def worlds(dtype):
    rng = np.random.default_rng(8)
    quat = rng.normal(size=(N, 4))
    arrays = {
        "state": [
            rng.normal(size=(N, 3)),
            quat / np.linalg.norm(quat, axis=1, keepdims=True),
            *rng.normal(size=(2, N, 3)),
        ],
        "body": [rng.uniform(4, 6, (N, 1)), rng.uniform(0.15, 0.25, (N, 3))],
        "push": list(0.05 * rng.normal(size=(2, N, 3))),
        "command": [(rng.uniform(size=(N, 8)) > 0.6)],
    }
    return {name: [array.astype(dtype) for array in parts] for name, parts in arrays.items()}


def advance(parts, planar):
    force, torque = ROBOT.actuators.wrench_in_body(parts["command"][0])
    return step(
        RigidBodyState(*parts["state"]),
        force,
        torque,
        body=MassProperties(*parts["body"]),
        disturbance=Disturbance(*parts["push"]),
        planar=planar,
        dt=0.02,
        substeps=10,
    )


@pytest.mark.parametrize("planar", [True, False], ids=["planar", "six degrees"])
# Rounding of some hundred operations on numbers of order 1.
@pytest.mark.parametrize(
    ("dtype", "atol"), [(np.float64, 1e-12), (np.float32, 1e-5)], ids=["float64", "float32"]
)
def test_torch_moves_every_world_as_numpy_does(planar, dtype, atol):
    parts = worlds(dtype)
    ours = advance(parts, planar)
    theirs = advance({name: [torch.as_tensor(a) for a in arrays] for name, arrays in parts.items()}, planar)
    for name in RigidBodyState.__slots__:
        result = getattr(theirs, name)
        assert isinstance(result, torch.Tensor)
        assert result.numpy().dtype == dtype
        np.testing.assert_allclose(result.numpy(), getattr(ours, name), rtol=0, atol=atol)
