"""A new policy of an aircraft flies level before it has learned anything; any other one begins at no command."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.dynamics.flight_trim import find_trim
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from training.learners import begin_near, build_learner, first_action
from training.settings import OffPolicy, load_training_settings
from training.train import train
from training.vec_env import BatchVecEnv

ROBOT = load_robot("airship_v7")
HOLD = load_task("fly_hold").fitted(ROBOT)
WORLDS = 4
ABOUT = 0.06  # of full command: what random weights of the last layer add


def new_learner(robot, task, algorithm=None):
    """A learner with the settings of a pair, over a few worlds."""
    settings = load_training_settings(robot, task, algorithm).algorithm
    if not isinstance(settings, OffPolicy):
        settings = replace(settings, steps=16, minibatch=16 * WORLDS)
    worlds = BatchVecEnv(robot, task, load_scenario("ideal"), worlds=WORLDS, seed=1)
    return build_learner(settings, worlds, seed=1), worlds


def answers(learner, observation):
    found, _ = learner.predict(observation, deterministic=True)
    return found


def shares_at(height):
    return find_trim(ROBOT, ROBOT.airframe.speed, height).command / ROBOT.actuators.scale


@pytest.mark.parametrize("algorithm", [None, "recurrent_ppo"])
def test_a_new_policy_answers_with_about_the_trim_whatever_it_observes(algorithm):
    learner, worlds = new_learner(ROBOT, HOLD, algorithm)
    begin_near(learner, first_action(ROBOT, HOLD))
    rng = np.random.default_rng(1)
    seen = worlds.reset()
    for observation in (seen, rng.normal(size=seen.shape).astype(np.float32)):
        np.testing.assert_allclose(
            answers(learner, observation), np.tile(shares_at(1.0), (WORLDS, 1)), rtol=0, atol=ABOUT
        )


@pytest.mark.slow
def test_craft_of_a_new_policy_stay_above_the_water_for_a_second_and_without_it_they_do_not():
    ended = []
    for action in (first_action(ROBOT, HOLD), None):
        learner, worlds = new_learner(ROBOT, HOLD)
        begin_near(learner, action)
        observation, lost = worlds.reset(), 0
        for _ in range(100):
            observation, _, done, _ = worlds.step(answers(learner, observation))
            lost += int(done.sum())
        ended.append(lost)
    assert ended[0] == 0 < ended[1]


def test_the_first_action_is_the_trim_of_where_the_task_flies():
    np.testing.assert_allclose(first_action(ROBOT, HOLD), shares_at(1.0))
    np.testing.assert_allclose(first_action(ROBOT, load_task("fly_a").fitted(ROBOT)), shares_at(1.0))
    for name in ("fly_attitude", "fly_airspeed"):
        high = first_action(ROBOT, load_task(name).fitted(ROBOT))
        np.testing.assert_allclose(high, shares_at(300.0), err_msg=name)
    assert np.abs(shares_at(300.0) - shares_at(1.0)).max() > 0.02


def test_no_other_robot_has_a_first_action():
    robot, task = load_robot("turtlebot2"), load_task("go_to_position")
    assert first_action(robot, task) is None
    learner, worlds = new_learner(robot, task)
    before = learner.policy.action_net.bias.detach().clone()
    begin_near(learner, None)
    assert (learner.policy.action_net.bias == before).all()
    assert np.abs(answers(learner, worlds.reset())).max() < ABOUT


def test_an_off_policy_learner_stays_as_it_is():
    learner, worlds = new_learner(ROBOT, HOLD, "sac")
    observation = worlds.reset()
    before = answers(learner, observation)
    begin_near(learner, first_action(ROBOT, HOLD))
    np.testing.assert_array_equal(answers(learner, observation), before)


def test_training_of_an_aircraft_begins_there(tmp_path, monkeypatch):
    kept = []

    def look(learner, *_):
        kept.append(learner)
        raise OSError("seen; it need not learn")

    monkeypatch.setattr("training.train._learn", look)
    settings = load_training_settings(ROBOT, HOLD)
    small = replace(settings.algorithm, minibatch=16 * WORLDS)
    with pytest.raises(OSError, match="need not learn"):
        train(
            ROBOT,
            HOLD,
            replace(settings, worlds=WORLDS, algorithm=small),
            seed=1,
            out=tmp_path / "run",
            updates=1,
        )
    bias = kept[0].policy.action_net.bias.detach().numpy()
    np.testing.assert_allclose(bias, shares_at(1.0), rtol=0, atol=1e-6)
