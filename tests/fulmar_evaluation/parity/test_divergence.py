"""Simulators under the same commands: what is equal does not part, what is not is found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import SafetyError
from fulmar_core.controllers.classical import load_classical
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.rotation import from_yaw
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from fulmar_evaluation.parity.divergence import Motion, divergence, noise_of, repeat_in, run_in_core
from sim_nodes.mock_backend import MockBackend

ROBOT, TASK, SCENARIO = load_robot("floating_platform"), load_task("go_to_pose"), load_scenario("nominal")
STEPS = 3


@pytest.fixture(scope="module")
def core():
    controller = load_classical(ROBOT, TASK)
    return run_in_core(controller, ROBOT, TASK, SCENARIO, runs=2, seed=5, steps=STEPS)


def motion(yaw, x=0.0):
    one = np.zeros((1, 3))
    return Motion.of([RigidBodyState(one + np.array([x, 0.0, 0.0]), from_yaw(np.array([yaw])), one, one)])


def test_the_mock_repeats_the_core_to_rounding(core):
    apart = divergence(core.motion, repeat_in(lambda: MockBackend(ROBOT), core))
    assert all(values.shape == (STEPS, 2) for values in apart.values())
    assert max(values.max() for values in apart.values()) < 1e-9


def test_a_simulator_with_half_the_thrust_parts_from_the_core(core):
    weak = replace(ROBOT, actuators=replace(ROBOT.actuators, thrust=0.5))
    apart = divergence(core.motion, repeat_in(lambda: MockBackend(weak), core))
    assert (apart["position_m"][-1] > 1e-3).all()
    assert (apart["position_m"][-1] > apart["position_m"][0]).all()


def test_a_simulator_that_loses_its_state_has_no_motion_from_then_on(core):
    class Failing(MockBackend):
        steps = 0

        def step(self, command, ticks=1, *, begins=None):
            self.steps += 1
            if self.steps == 2:
                raise SafetyError("lost")
            return super().step(command, ticks, begins=begins)

    found = repeat_in(lambda: Failing(ROBOT), core)
    lost = np.isnan(found.position[..., 0])
    assert lost.tolist() == [[False, False], [True, False], [True, False]]


def test_angles_are_those_between_attitudes_whatever_their_sign():
    a, b = motion(0.3, 1.0), motion(0.3 + 1e-7)
    assert divergence(a, b)["attitude_deg"][0, 0] == pytest.approx(np.degrees(1e-7), rel=1e-3)
    assert divergence(a, b)["position_m"][0, 0] == pytest.approx(1.0)
    other = replace(b, quat=-b.quat)
    assert divergence(a, other)["attitude_deg"][0, 0] == pytest.approx(np.degrees(1e-7), rel=1e-3)
    assert divergence(motion(0.0), motion(np.pi))["attitude_deg"][0, 0] == pytest.approx(180.0)


def test_the_noise_is_that_of_the_odometry():
    assert noise_of(ROBOT)["position_m"] == ROBOT.sensors.odometry.position.std
    assert noise_of(ROBOT)["attitude_deg"] == pytest.approx(np.degrees(0.002))
