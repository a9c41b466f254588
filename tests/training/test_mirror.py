"""Policies that see goals on the right as on the left, or those behind as those ahead."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from stable_baselines3.common.vec_env import VecNormalize

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.symmetry import Mirror
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from training.deploy import deployed_network
from training.learners import build_learner
from training.settings import load_training_settings
from training.vec_env import BatchVecEnv

TASK = load_task("go_through_positions")
ROBOTS = {"sides": load_robot("kingfisher"), "ends": load_robot("turtlebot2")}
MIRRORS = {alike: Mirror.of(robot, TASK, alike) for alike, robot in ROBOTS.items()}
both = pytest.mark.parametrize("alike", list(ROBOTS))


def worlds(alike, mirror=True, count=16):
    return BatchVecEnv(
        ROBOTS[alike],
        TASK,
        load_scenario("nominal"),
        worlds=count,
        seed=3,
        mirror=alike if mirror else None,
    )


@both
def test_every_goal_is_shown_on_the_left_or_ahead(alike):
    plain, mirrored, mirror = worlds(alike, mirror=False).reset(), worlds(alike).reset(), MIRRORS[alike]
    other = plain[:, mirror.side] < 0.0
    assert 0 < other.sum() < len(other)
    assert np.all(mirrored[:, mirror.side] >= 0.0)
    np.testing.assert_array_equal(mirrored[~other], plain[~other])
    np.testing.assert_allclose(mirrored[other], plain[other] @ mirror.seen)


@both
def test_an_answer_to_a_mirrored_goal_is_mirrored_back(alike):
    plain, mirrored, mirror = worlds(alike, mirror=False), worlds(alike), MIRRORS[alike]
    other = plain.reset()[:, mirror.side] < 0.0
    mirrored.reset()
    actions = np.tile(np.array([0.9, 0.3], dtype=np.float32), (16, 1))
    mirrored.step(actions)
    actions[other] = actions[other] @ mirror.done
    plain.step(actions)
    np.testing.assert_array_equal(mirrored.simulation.truth.x, plain.simulation.truth.x)
    np.testing.assert_array_equal(mirrored.simulation.truth.yaw, plain.simulation.truth.yaw)


def test_a_resumed_run_remembers_which_goals_were_mirrored():
    first, second = worlds("sides"), worlds("sides")
    first.reset()
    second.reset()
    first.step(np.zeros((16, 2), dtype=np.float32))
    second.set_state(first.state())
    actions = np.tile(np.array([0.9, 0.3], dtype=np.float32), (16, 1))
    np.testing.assert_array_equal(first.step(actions)[0], second.step(actions)[0])


@both
def test_a_deployed_policy_answers_the_mirror_image_with_the_mirror_image(alike, small_settings):
    env, mirror = VecNormalize(worlds(alike), norm_reward=False), MIRRORS[alike]
    learner = build_learner(small_settings.algorithm, env, seed=3)
    env.reset()
    network = deployed_network(learner, env, ROBOTS[alike].actuators.scale)
    seen = torch.from_numpy(worlds(alike, mirror=False).reset().astype(np.float32))
    image = seen @ torch.from_numpy(mirror.seen)
    command, other = network(seen)[0], network(image)[0]
    torch.testing.assert_close(other, command @ torch.from_numpy(mirror.done))


def test_networks_with_a_memory_are_refused():
    with pytest.raises(ValueError, match="'mirror' is for networks without memory"):
        replace(load_training_settings(ROBOTS["sides"], TASK, "recurrent_ppo"), mirror="sides")
