"""A policy that begins by cloning a classical law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from stable_baselines3.common.vec_env import VecNormalize

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.classical import load_classical
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from training.behavior_cloning import BehaviorCloningPPO, expert_of
from training.checkpoint import load_checkpoint
from training.fast_ppo import FastPPO
from training.learners import build_learner, callbacks_of
from training.run_folder import CHECKPOINT_FILE
from training.train import train
from training.vec_env import BatchVecEnv

ROBOT, TASK = load_robot("floating_platform"), load_task("drift_go_to_pose")
CLONING = 12


@pytest.fixture
def settings(small_settings):
    algorithm = replace(small_settings.algorithm, cloning_updates=CLONING, log_std=-2.0)
    return replace(
        small_settings,
        algorithm=algorithm,
        scenario="drift_training",
        disturbance_inputs=True,
        action_space="wrench",
    )


def worlds(count=32, *, disturbance_inputs=True, action_space="wrench"):
    return BatchVecEnv(
        ROBOT,
        TASK,
        load_scenario("drift_training"),
        worlds=count,
        seed=3,
        disturbance_inputs=disturbance_inputs,
        action_space=action_space,
    )


def learned(settings, updates):
    env = VecNormalize(worlds(), norm_reward=False)
    learner = build_learner(settings.algorithm, env, seed=3)
    learner.learn(32 * 16 * updates, callback=callbacks_of(learner))
    return learner, env


def error(learner, env):
    """Mean squared difference between what the learner and its expert would do, in the worlds' present states."""
    raw = env.get_original_obs()
    actions, _ = learner.predict(env.normalize_obs(raw), deterministic=True)
    return float(np.mean((actions - expert_of(env.unwrapped).actions(raw)) ** 2))


@pytest.mark.slow
def test_cloning_brings_a_policy_near_to_the_lqr(settings):
    many = replace(settings.algorithm, cloning_updates=60)
    assert error(*learned(replace(settings, algorithm=many), 60)) < 0.3 * error(*learned(settings, 1))


def test_after_its_cloning_updates_it_learns_by_ppo(settings, monkeypatch):
    calls = []
    monkeypatch.setattr(FastPPO, "train", lambda self: calls.append(self.cloned))
    learner, _ = learned(settings, CLONING + 2)
    assert isinstance(learner, BehaviorCloningPPO)
    assert calls == [CLONING, CLONING]


def test_cloning_keeps_the_exploration_noise(settings):
    learner, _ = learned(settings, CLONING)
    np.testing.assert_allclose(learner.policy.log_std.detach().numpy(), -2.0)


@pytest.mark.slow
@pytest.mark.parametrize("first", [5, CLONING + 1], ids=["within the cloning updates", "after them"])
def test_a_resumed_cloning_run_ends_with_the_weights_of_an_uninterrupted_one(tmp_path, settings, first):
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    train(ROBOT, TASK, settings, seed=1, out=whole, updates=CLONING + 2)
    train(ROBOT, TASK, settings, seed=1, out=parts, updates=first)
    torch.manual_seed(99)
    train(ROBOT, TASK, settings, seed=1, out=parts, updates=CLONING + 2, resume=True)
    expected, found = (
        load_checkpoint(folder / CHECKPOINT_FILE, settings.algorithm, worlds())[0].policy.state_dict()
        for folder in (whole, parts)
    )
    for key, value in expected.items():
        assert torch.equal(value, found[key]), key


def test_the_expert_takes_pushes_from_the_disturbance_inputs(settings):
    env = worlds(4)
    seen = env.reset()
    pushed = seen.copy()
    pushed[:, -11] = 0.3  # N ahead
    expert = expert_of(env)
    assert np.all(expert.actions(pushed)[:, 0] <= expert.actions(seen)[:, 0] + 1e-6)
    assert not np.array_equal(expert.actions(pushed), expert.actions(seen))


def test_cloning_of_single_valves_is_rejected():
    with pytest.raises(ConfigError, match="Set 'action_space: wrench'"):
        expert_of(worlds(4, action_space="actuators"))


def test_cloning_needs_the_fast_ppo(settings):
    with pytest.raises(ValueError, match="'cloning_updates' are for the fast PPO"):
        replace(settings, algorithm=replace(settings.algorithm, fast=False))


@pytest.mark.parametrize("robot", ["kingfisher", "turtlebot2", "leatherback", "modular_freeflyer"])
def test_where_actions_are_commands_the_expert_gives_those_of_its_law(robot):
    the_robot, task = load_robot(robot), load_task("go_to_position")
    env = BatchVecEnv(the_robot, task, load_scenario("nominal"), worlds=4, seed=3)
    seen = env.reset()
    commanded = the_robot.actuators.limited(expert_of(env).actions(seen) * the_robot.actuators.scale)
    np.testing.assert_allclose(commanded, law_of(the_robot, task).act(env.inputs()), atol=1e-6)


def test_an_expert_of_mirrored_worlds_commands_what_its_law_commands():
    robot, task = load_robot("kingfisher"), load_task("go_to_position")
    env = BatchVecEnv(robot, task, load_scenario("nominal"), worlds=16, seed=3, mirror="sides")
    seen = env.reset()
    actions = expert_of(env).actions(seen)
    commands = robot.actuators.limited(env.answered(actions) * robot.actuators.scale)
    expected = law_of(robot, task).act(env.inputs())
    np.testing.assert_allclose(commands, expected, atol=1e-6)
    plain = robot.actuators.limited(actions * robot.actuators.scale)
    assert 0 < np.sum(np.abs(plain - expected).max(axis=1) > 0.01) < 16  # some are mirrored


def law_of(robot, task):
    """The law of the robot's family, afresh; an LQR without what it remembers."""
    law = load_classical(robot, task)
    return (
        type(law)(robot, task, replace(law.gains, observer=None)) if hasattr(law.gains, "observer") else law
    )
