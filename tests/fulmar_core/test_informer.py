"""Controllers that listen are told of their actuators' health; others cost nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.controllers.controller import Controller
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.health.informer import Informed, Informer
from fulmar_core.planar import PlanarState
from fulmar_core.robot import load_robot
from fulmar_core.rollout import roll_out_in_backends, roll_out_in_batch
from fulmar_core.tasks import load_task
from sim_nodes.mock_backend import MockBackend

PLATFORM, BOAT = load_robot("floating_platform"), load_robot("kingfisher")
TASK = replace(load_task("drift_go_to_pose"), episode_s=8.0)


class Deaf:
    """Opens one valve after the other."""

    name, control_hz, observation_names = "deaf", 5.0, TASK.observation_names

    def reset(self):
        self.k = 0

    def act(self, observation):
        self.k += 1
        return np.tile(np.eye(8)[self.k % 8], (len(observation), 1))

    def metadata(self):
        return {"sha256": ""}


class Listening(Deaf):
    """The same, and keeps what it hears."""

    def reset(self):
        super().reset()
        self.heard = []

    def inform(self, health):
        self.heard.append(health)


def roll_out(controller, through):
    given = {"task": TASK, "scenario": load_scenario("drift_one_lost"), "episodes": 4, "seed": 3}
    if through == "batch":
        return roll_out_in_batch(controller, PLATFORM, **given)
    return roll_out_in_backends(controller, lambda: MockBackend(PLATFORM), **given)


def test_a_controller_says_by_one_method_whether_it_listens():
    assert isinstance(Listening(), Informed)
    assert not isinstance(Deaf(), Informed)


@pytest.mark.parametrize("through", ["batch", "backends"])
def test_it_is_told_before_every_step_and_soon_knows_which_valve_is_lost(through):
    controller = Listening()
    roll_out(controller, through)
    assert len(controller.heard) == 40
    assert controller.heard[0].effectiveness.shape == (4, 8)
    assert np.all(controller.heard[0].alive == 1.0)
    np.testing.assert_array_equal(8 - controller.heard[-1].alive.sum(axis=1), 1)


def test_it_is_told_the_same_in_the_batch_and_in_a_backend():
    heard = []
    for through in ("batch", "backends"):
        controller = Listening()
        roll_out(controller, through)
        heard.append(controller.heard[-1])
    np.testing.assert_array_equal(heard[0].alive, heard[1].alive)
    np.testing.assert_allclose(heard[0].push, heard[1].push, atol=0.02)


def test_nothing_is_reckoned_for_those_who_do_not_listen_or_cannot_be_watched():
    zero = np.zeros(1)
    here = PlanarState(zero, zero, zero, zero, zero, zero)
    deaf: Controller = Deaf()
    assert Informer(PLATFORM, deaf).see(here, np.zeros((1, 8)), 0.2) is None
    assert Informer(BOAT, Listening()).see(here, np.zeros((1, 2)), 0.2, wanted=True) is None
    wanted = Informer(PLATFORM, deaf).see(here, np.zeros((1, 8)), 0.2, wanted=True)
    assert wanted is not None and wanted.effectiveness.min() > 0.9
