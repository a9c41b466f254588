"""Policies that move actuators with slew astern or ahead, or hold them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from stable_baselines3.common.vec_env import VecNormalize

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.symmetry import Mirror
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from training.deploy import deployed_network
from training.learners import build_learner
from training.network import load_network, save_network
from training.run_folder import NETWORK_FILE
from training.settings import IncrementalActions, load_training_settings
from training.train import train
from training.vec_env import BatchVecEnv

BOAT, TASK = load_robot("kingfisher"), load_task("go_through_positions")
ASTERN, AS_IT_IS, AHEAD = 0, 1, 2
STEP = BOAT.actuators.response.slew[0] / BOAT.timing.control_hz  # of a command, in one control step


def worlds(hold, robot=BOAT, scenario="nominal", **more):
    return BatchVecEnv(
        robot, TASK, load_scenario(scenario), worlds=16, seed=3, staggered=False, action_hold=hold, **more
    )


def ordered(left, right):
    return np.tile(np.array([left, right]), (16, 1))


def test_an_action_moves_a_command_as_far_as_slew_allows():
    env = worlds(hold=1)
    env.reset()
    env.step(ordered(AHEAD, ASTERN))
    np.testing.assert_allclose(env.simulation.command, np.tile([STEP, -STEP], (16, 1)), rtol=1e-6)
    env.step(ordered(AS_IT_IS, AHEAD))
    np.testing.assert_allclose(env.simulation.command, np.tile([STEP, 0.0], (16, 1)), atol=1e-7)


def test_a_held_action_is_repeated_and_its_rewards_are_added_up():
    held, again = worlds(hold=3), worlds(hold=1)
    held.reset()
    again.reset()
    observations, rewards, _, _ = held.step(ordered(AHEAD, AS_IT_IS))
    steps = [again.step(ordered(AHEAD, AS_IT_IS)) for _ in range(3)]
    np.testing.assert_array_equal(observations, steps[-1][0])
    np.testing.assert_allclose(rewards, sum(step[1] for step in steps), rtol=1e-5)


def test_held_actions_do_not_lengthen_episodes():
    env = worlds(hold=7)  # 600 steps are no multiple of it
    env.reset()
    ended = [env.step(ordered(AS_IT_IS, AS_IT_IS))[2].all() for _ in range(86)]
    assert not any(ended[:-1])
    assert ended[-1]


def test_an_episode_that_ends_during_a_held_action_ends_with_it():
    env = worlds(hold=3, robot=replace(BOAT, limits=replace(BOAT.limits, geofence=1e-3)))
    env.reset()
    _, _, dones, infos = env.step(ordered(AHEAD, AHEAD))
    assert dones.all()
    assert not any(info["TimeLimit.truncated"] for info in infos)


def test_an_episode_that_ends_under_way_has_ended_also_if_the_last_step_says_nothing(monkeypatch):
    env = worlds(hold=3)
    env.reset()
    seen = np.asarray(env.simulation.observe())
    over = iter([np.arange(16) == 4, np.arange(16) == 7, np.zeros(16, dtype=bool)])
    monkeypatch.setattr(env, "_step", lambda: (np.zeros(16, dtype=np.float32), next(over), seen))
    assert np.flatnonzero(env.step(ordered(AHEAD, AHEAD))[2]).tolist() == [4, 7]


def test_actions_for_a_mirrored_goal_are_mirrored_back():
    plain, mirrored, mirror = worlds(hold=2), worlds(hold=2, mirror="sides"), Mirror.of(BOAT, TASK, "sides")
    other = plain.reset()[:, mirror.side] < 0.0
    assert 0 < other.sum() < len(other)
    mirrored.reset()
    mirrored.step(ordered(AHEAD, ASTERN))
    actions = ordered(AHEAD, ASTERN)
    actions[other] = actions[other][:, ::-1]
    plain.step(actions)
    np.testing.assert_array_equal(mirrored.simulation.command, plain.simulation.command)


@pytest.fixture(scope="module")
def deployed(small_settings):
    env = VecNormalize(worlds(hold=3, mirror="sides", scenario="uncertain"), norm_reward=False)
    learner = build_learner(small_settings.algorithm, env, seed=3)
    env.reset()
    for _ in range(5):  # for commands that are not zero
        env.step(np.stack([env.action_space.sample() for _ in range(16)]))
    return learner, env, deployed_network(learner, env, BOAT.actuators.scale)


def test_a_deployed_network_commands_the_likeliest_actions(deployed):
    learner, env, network = deployed
    rows = np.asarray(env.venv.simulation.observe())  # as a robot sees it: neither mirrored nor normalised
    mirror, previous = env.venv.mirror, rows[:, -2:]
    other = rows[:, mirror.side] < 0.0
    shown = np.where(other[:, None], rows @ mirror.seen, rows)
    actions = learner.predict(env.normalize_obs(shown), deterministic=True)[0] - 1.0
    actions[other] = actions[other] @ mirror.done
    assert 0 < (actions == 0.0).sum() < actions.size
    asked = np.where(actions == 0.0, previous, actions)
    command, raw, _ = network.infer(rows)
    np.testing.assert_allclose(command, asked * BOAT.actuators.scale, atol=1e-6)
    assert raw.shape == command.shape


def test_a_network_of_incremental_actions_is_read_back_as_it_was_written(deployed, tmp_path):
    _, env, network = deployed
    save_network(network, tmp_path / "network.pt")
    seen = np.asarray(env.venv.simulation.observe())
    again = load_network(tmp_path / "network.pt")
    np.testing.assert_array_equal(again.infer(seen)[0], network.infer(seen)[0])


def test_a_run_counts_control_steps(small_settings, tmp_path):
    settings = replace(small_settings, incremental_actions=IncrementalActions(hold=3), mirror="sides")
    record = train(BOAT, TASK, settings, seed=1, out=tmp_path, updates=1)
    assert record["steps"] == settings.worlds * settings.algorithm.steps * 3
    assert record["curve"][-1]["steps"] == record["steps"]
    plan = load_network(tmp_path / NETWORK_FILE).plan
    assert (plan.decision, plan.side is None) == ("increment", False)


def test_robots_without_slew_take_no_incremental_actions():
    robot = load_robot("floating_platform")
    with pytest.raises(
        ConfigError, match="'incremental_actions': the actuators of 'floating_platform' have no slew"
    ):
        worlds(hold=3, robot=robot)


def test_a_hold_of_no_step_is_rejected():
    with pytest.raises(ValueError, match="'hold' must be at least 1"):
        IncrementalActions(hold=0)


@pytest.mark.parametrize("more", [{"disturbance_inputs": True}, {"action_space": "wrench"}])
def test_networks_with_disturbance_inputs_or_wrenches_take_no_incremental_actions(more):
    with pytest.raises(ValueError, match="'incremental_actions' are for ppo, without"):
        replace(load_training_settings(BOAT, TASK), **more)


@pytest.mark.parametrize("name", ["recurrent_ppo", "kingfisher_go_to_position_with_obstacles", "sac"])
def test_other_learners_take_no_incremental_actions(name):
    with pytest.raises(ValueError, match="'incremental_actions' are for ppo, without"):
        replace(load_training_settings(BOAT, TASK, name), incremental_actions=IncrementalActions(hold=3))
