"""What a controller node believes of its robot's actuators begins anew where its past says nothing any more."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.estimators.actuator_health.applied import AppliedHistory
from fulmar_core.estimators.actuator_health.beliefs import NO_EFFECT, Beliefs
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.input_gate import Measurement
from fulmar_core.states.state import RigidBodyState
from fulmar_ros.actuator_beliefs import ActuatorBeliefs

STEP_NS = 200_000_000


class Held:
    """A platform in a hand, whose valves open one after the other; what its node believes."""

    def __init__(self, robot="floating_platform"):
        settings = ControllerSettings(robot=robot, lockstep=True)
        self._applied = AppliedHistory(2 * STEP_NS)
        self._of = ActuatorBeliefs(load_robot(robot), settings, self._applied)
        self._rng, self._count = np.random.default_rng(1), len(load_robot(robot).actuators.names)
        self._ns = 0

    def go(self, steps, *, epoch=0, stands=False):
        rng = self._rng
        for number in range(steps):
            position, velocity = (np.array([*rng.normal(0.0, std, 2), 0.0]) for std in (0.001, 0.005))
            state = RigidBodyState(position, np.array([0.0, 0.0, 0.0, 1.0]), velocity, np.zeros(3))
            measured = Measurement(self._ns, "odom", "base_link", state)
            believed = self._of.of(measured, epoch=epoch, stands=stands)
            self._applied.add(self._ns, np.eye(self._count)[number % self._count])
            self._ns += STEP_NS
        return believed


def test_a_robot_in_a_hand_is_said_to_be_held():
    assert Held().go(60).words == (NO_EFFECT,)


@pytest.mark.parametrize("what", [{"epoch": 1}, {"stands": True}])
def test_after_a_jump_and_without_air_nothing_is_believed_of_before(what):
    held = Held()
    held.go(60)
    assert held.go(2, **what) == Beliefs()


def test_reaction_wheels_which_are_measured_are_none_of_its_business():
    assert Held("cubesat_wheels").go(30) == Beliefs()
