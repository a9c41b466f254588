"""The MPC: what it does to a platform, and that it looks further than the LQR that it follows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.paths import config_path
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.controllers.mpc import Mpc, MpcGains
from fulmar_core.loop.rollout import roll_out_in_batch
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.metrics import episode_metrics
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_at
from fulmar_core.worlds.scenario import load_scenario
from tests.inputs import inputs_at, some_of

ROBOT, TASK = load_robot("floating_platform"), load_task("drift_go_to_pose")
GAINS = load_config(MpcGains, config_path("controllers", "floating_platform_mpc"))


def figures(scenario, gains=GAINS, episodes=8):
    law = Mpc(ROBOT, TASK, gains)
    run = roll_out_in_batch(law, ROBOT, TASK, load_scenario(scenario), episodes=episodes, seed=3)
    return {name: values.mean() for name, values in episode_metrics(run, TASK).items()}


@pytest.mark.parametrize("scenario", ["drift_force_4", "drift_one_lost"])
def test_it_holds_its_pose_against_a_force_and_without_a_valve(scenario):
    found = figures(scenario)
    assert found["PT2_percent"] >= 65.0
    assert found["OT5_percent"] >= 85.0


@pytest.mark.slow
def test_a_higher_valve_cost_opens_fewer_valves():
    saved, spent = (figures("drift_ideal", replace(GAINS, gas=gas), episodes=4) for gas in (1.0, 0.0))
    assert saved["AAS"] < 0.8 * spent["AAS"]


def test_one_robot_is_steered_as_in_a_batch():
    law = Mpc(ROBOT, TASK, GAINS)
    states = np.random.default_rng(1).uniform(-1.0, 1.0, (6, 6))
    inputs = inputs_at(ROBOT, TASK, PlanarState(*states), goal_at((0.0, 0.0, 0.0)))
    many = law.act(inputs)
    assert len({command.tobytes() for command in many}) > 1
    for i, expected in enumerate(many):
        law.reset()
        np.testing.assert_array_equal(law.act(some_of(inputs, [i]))[0], expected)


def test_gains_that_lead_nowhere_are_refused():
    with pytest.raises(ValueError, match="'choices' and 'steps'"):
        replace(GAINS, steps=0)
    with pytest.raises(ValueError, match="'observer' is missing"):
        replace(GAINS, observer=None)
