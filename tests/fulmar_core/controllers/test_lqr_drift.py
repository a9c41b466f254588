"""DRIFT's own LQR: its model, its rounding, and that it behaves as thesis Table 3.5 says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.paths import config_path
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.lqr_drift import DriftWeights, LqrDrift
from fulmar_core.loop.rollout import roll_out_in_batch
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.metrics import episode_metrics
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario

ROBOT, TASK = load_robot("floating_platform"), load_task("drift_go_to_pose")
WEIGHTS = load_config(DriftWeights, config_path("controllers", "floating_platform_lqr_drift"))


@pytest.fixture(scope="module")
def law():
    return load_classical(ROBOT, TASK, law="lqr_drift")


def figures(law, scenario, episodes=24):
    run = roll_out_in_batch(law, ROBOT, TASK, load_scenario(scenario), episodes=episodes, seed=2)
    return {name: values.mean() for name, values in episode_metrics(run, TASK).items()}


def test_its_model_is_a_body_that_glides_and_a_quaternion_that_turns(law):
    a, b = law.model(0.0, 0.0)
    expected = np.eye(7)
    expected[0, 2] = expected[1, 3] = 0.2
    expected[5, 6] = 0.1  # half an angle
    np.testing.assert_allclose(a, expected, atol=1e-6)
    assert (b != 0.0).all()  # zeros are written over
    # The first nozzle, 1 N at -45°, for 0.2 s; the negative difference is too short by √½.
    share = 0.5 * (1.0 + np.sqrt(0.5))
    assert b[2, 0] == pytest.approx(share * np.sqrt(0.5) * 0.2 / 5.32, rel=1e-3)
    assert b[6, 0] == pytest.approx(-share * 0.31 * 0.2 / 0.2045, rel=1e-3)


def test_valves_open_for_what_is_among_the_largest_and_for_nothing_small(law):
    inputs = [[2.0, 1.4, 1.6, 0.1, 0.0, 0.0, 0.0, 0.0], [0.2] * 8, [1.0, -1.0, 0.4, 0.6] + [0.0] * 4]
    expected = [[1, 0, 1, 0, 0, 0, 0, 0], [0] * 8, [1, 0, 0, 1, 0, 0, 0, 0]]
    np.testing.assert_array_equal(law._valves_of(np.array(inputs)), expected)


@pytest.mark.slow
def test_it_comes_near_the_goal_and_hardly_holds_its_heading_least_of_all_against_a_torque(law):
    ideal, torque = figures(law, "drift_ideal"), figures(law, "drift_torque")
    assert ideal["PT5_percent"] > 50.0
    assert ideal["OT5_percent"] < 75.0
    assert ideal["OT1_percent"] < 35.0
    assert torque["PT5_percent"] > 60.0
    assert torque["OT5_percent"] < 0.7 * ideal["OT5_percent"]


def test_the_weights_of_the_thesis_table_do_not_move_the_platform():
    table = replace(WEIGHTS, states=(1e-4, 1e-5, 100.0, 100.0, 1e-6, 1e-6, 1.0))
    still = figures(LqrDrift(ROBOT, TASK, table), "drift_ideal", episodes=6)
    assert still["PT5_percent"] == 0.0
    assert still["AAS"] < 0.04


def test_weights_without_a_solution_are_refused():
    with pytest.raises(ValueError, match="must be greater than 0"):
        replace(WEIGHTS, input=0.0)
