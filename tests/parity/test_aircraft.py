"""An aircraft under its LQI in the core's batch, in the mock and in MuJoCo: one flight, in turbulence or without."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.controllers.classical import load_classical
from fulmar_core.loop.rollout import roll_out_in_backends, roll_out_in_batch
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.worlds.parts import Air
from fulmar_core.worlds.scenario import Scenario
from sim_nodes.mock_backend import MockBackend
from sim_nodes.mujoco_backend import MujocoBackend

CRAFT = load_robot("airship_v7")
EXACT = Scenario("exact", sensor_noise=False, body="nominal")


def flown(backend, scenario, task):
    controller = load_classical(CRAFT, task)
    given = {"task": task, "scenario": scenario, "episodes": 2, "seed": 3}
    if backend is None:
        return roll_out_in_batch(controller, CRAFT, **given)
    return roll_out_in_backends(controller, backend, **given)


@pytest.mark.parametrize(
    ("turbulence", "seconds", "moved"),
    [
        pytest.param(0.0, 2.0, 1e-4, marks=pytest.mark.slow),
        pytest.param(7.7, 2.0, 0.05, marks=pytest.mark.slow),
        (7.7, 0.3, 0.005),
    ],
)
def test_one_flight_is_the_same_in_the_batch_the_mock_and_mujoco(turbulence, seconds, moved):
    task = replace(load_task("fly_a"), episode_s=seconds)
    scenario = replace(EXACT, air=Air(turbulence=turbulence))
    batch = flown(None, scenario, task)
    assert np.ptp(batch.z) > moved
    for make in (lambda: MockBackend(CRAFT), lambda: MujocoBackend.of(CRAFT, task, scenario)):
        other = flown(make, scenario, task)
        np.testing.assert_allclose(other.z, batch.z, rtol=0, atol=max(0.2 * moved, 1e-3))
        np.testing.assert_allclose(other.y, batch.y, rtol=0, atol=0.01)
        assert not other.touching.any()
