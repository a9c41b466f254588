"""Policies that see goals on the right as on the left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from stable_baselines3.common.vec_env import VecNormalize

from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.robot import load_robot
from fulmar_core.symmetry import Mirror
from fulmar_core.tasks import load_task
from training.deploy import deployed_network
from training.learners import build_learner
from training.settings import load_training_settings
from training.vec_env import BatchVecEnv

ROBOT, TASK = load_robot("kingfisher"), load_task("go_through_positions")
MIRROR = Mirror.of(ROBOT, TASK)


def worlds(mirror, count=16):
    return BatchVecEnv(ROBOT, TASK, load_scenario("nominal"), worlds=count, seed=3, mirror=mirror)


def test_every_goal_is_shown_on_the_left():
    plain, mirrored = worlds(False).reset(), worlds(True).reset()
    right = plain[:, MIRROR.side] < 0.0
    assert 0 < right.sum() < len(right)
    np.testing.assert_array_equal(mirrored[~right], plain[~right])
    np.testing.assert_allclose(mirrored[right], plain[right] @ MIRROR.seen)


def test_an_answer_to_a_mirrored_goal_is_mirrored_back():
    plain, mirrored = worlds(False), worlds(True)
    right = plain.reset()[:, MIRROR.side] < 0.0
    mirrored.reset()
    actions = np.tile(np.array([0.9, 0.3], dtype=np.float32), (16, 1))
    mirrored.step(actions)
    actions[right] = actions[right] @ MIRROR.done
    plain.step(actions)
    np.testing.assert_array_equal(mirrored.simulation.truth.yaw, plain.simulation.truth.yaw)


def test_a_resumed_run_remembers_which_goals_were_mirrored():
    first, second = worlds(True), worlds(True)
    first.reset()
    second.reset()
    first.step(np.zeros((16, 2), dtype=np.float32))
    second.set_state(first.state())
    actions = np.tile(np.array([0.9, 0.3], dtype=np.float32), (16, 1))
    np.testing.assert_array_equal(first.step(actions)[0], second.step(actions)[0])


def test_a_deployed_policy_answers_the_mirror_image_with_the_mirror_image(small_settings):
    env = VecNormalize(worlds(True), norm_reward=False)
    learner = build_learner(small_settings.algorithm, env, seed=3)
    env.reset()
    network = deployed_network(learner, env, ROBOT.actuators.scale)
    seen = torch.from_numpy(worlds(False).reset().astype(np.float32))
    image = seen @ torch.from_numpy(MIRROR.seen)
    command, other = network(seen)[0], network(image)[0]
    torch.testing.assert_close(other, command @ torch.from_numpy(MIRROR.done))


def test_networks_with_a_memory_are_refused():
    with pytest.raises(ValueError, match="'mirror' is for networks without memory"):
        replace(load_training_settings(ROBOT, TASK, "recurrent_ppo"), mirror=True)
