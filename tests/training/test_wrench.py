"""Networks whose actions are wrenches, from learning to the bundle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from stable_baselines3.common.vec_env import VecNormalize

from fulmar_core.config.errors import ConfigError
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.loop.policy_bundle import read_golden
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.worlds.scenario import load_scenario
from policy_server.policy import Policy
from training.deploy import deployed_network
from training.export import export
from training.learners import build_learner, callbacks_of
from training.network import NetworkController, load_network, save_network
from training.train import train
from training.vec_env import BatchVecEnv

ROBOT, TASK = load_robot("floating_platform"), load_task("drift_go_to_pose")


@pytest.fixture(
    scope="module",
    params=[True, pytest.param(False, marks=pytest.mark.slow)],
    ids=["disturbance inputs", "none"],
)
def learner(request, small_settings):
    worlds = BatchVecEnv(
        ROBOT,
        TASK,
        load_scenario("drift_training"),
        worlds=32,
        seed=3,
        disturbance_inputs=request.param,
        action_space="wrench",
    )
    env = VecNormalize(worlds, norm_reward=False)
    ppo = build_learner(small_settings.algorithm, env, seed=3)
    ppo.learn(32 * 16 * 4, callback=callbacks_of(ppo))
    with torch.no_grad():
        ppo.policy.action_net.weight *= 100.0  # as bold as after a long training
    return ppo, env


@pytest.fixture(scope="module")
def bundle(learner, small_settings, tmp_path_factory):
    """A bundle of the learner's network."""
    run, out = tmp_path_factory.mktemp("run"), tmp_path_factory.mktemp("bundle")
    settings = replace(
        small_settings,
        scenario="drift_training",
        disturbance_inputs=learner[1].unwrapped.takes_disturbances,
        action_space="wrench",
    )
    train(ROBOT, TASK, settings, seed=3, updates=1, out=run)
    save_network(deployed_network(*learner, ROBOT.actuators.scale), run / "network.pt")
    export(run, out)
    return out


def test_actions_are_wrenches_and_what_the_robot_gets_are_valves():
    env = BatchVecEnv(ROBOT, TASK, load_scenario("drift_ideal"), worlds=4, seed=1, action_space="wrench")
    env.reset()
    assert env.action_space.shape == (3,)
    env.step(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [9.0, 9.0, 9.0]]))
    command = np.asarray(env.simulation.command)
    assert command.shape == (4, 8)
    assert set(np.unique(command)) == {0.0, 1.0}
    assert not command[2].any()


def test_valves_that_are_known_to_be_dead_stay_closed():
    env = BatchVecEnv(
        ROBOT,
        TASK,
        load_scenario("drift_two_lost"),
        worlds=64,
        seed=1,
        disturbance_inputs=True,
        action_space="wrench",
    )
    env.reset()
    rng = np.random.default_rng(2)
    for _ in range(60):
        env.step(rng.uniform(-1.0, 1.0, (64, 3)))
    known = np.asarray(env._disturbances.dead)
    assert known.sum() > 100
    env.step(rng.uniform(-1.0, 1.0, (64, 3)))
    assert not (np.asarray(env.simulation.command) * known).any()


def test_the_bundle_opens_the_valves_that_training_would_have_opened(learner, bundle):
    ppo, env = learner
    seen = read_golden(bundle).observations
    shares, _ = ppo.predict(env.normalize_obs(seen), deterministic=True)
    dead = 1.0 - torch.from_numpy(seen[:, -8:]) if env.unwrapped.takes_disturbances else None
    trained = env.unwrapped.choice.best(torch.from_numpy(shares), dead).numpy()
    network = deployed_network(ppo, env, ROBOT.actuators.scale)
    commands, margins, _ = network.infer(seen)
    clear = np.abs(margins) > 1e-4
    assert clear.mean() > 0.9
    np.testing.assert_array_equal(commands[clear], trained[clear])
    assert 0.0 < trained.mean() < 1.0


def test_the_served_policy_flies_as_the_network_does(learner, bundle):
    served = Policy(bundle, ROBOT, TASK)
    network = network_of(learner)
    env = BatchVecEnv(ROBOT, TASK, load_scenario("drift_one_lost"), worlds=8, seed=5)
    env.reset()
    twin = NetworkController(network, ROBOT, TASK, ROBOT.timing.control_hz)
    loop = ControlLoop(ROBOT, TASK, served, robots=8)
    loop.begin(goal_in_float64(env.simulation.goal))
    for number in range(5):
        inputs = loop.inputs(env.simulation.measured, {}, round(1e9 * number * loop.dt))
        assert (inputs.estimates is not None) == learner[1].unwrapped.takes_disturbances
        step = loop.act(inputs)
        np.testing.assert_array_equal(step.action, twin.act(inputs))
        env.simulation.move(step.command)


def network_of(learner):
    return deployed_network(*learner, ROBOT.actuators.scale)


def test_a_network_that_asks_for_wrenches_is_the_same_after_saving(learner, tmp_path):
    network = network_of(learner)
    save_network(network, tmp_path / "network.pt")
    seen = np.random.default_rng(1).normal(size=(50, network.plan.inputs)).astype(np.float32)
    np.testing.assert_array_equal(
        load_network(tmp_path / "network.pt").infer(seen)[1], network.infer(seen)[1]
    )


def test_a_robot_without_on_off_valves_cannot_be_asked_for_wrenches():
    with pytest.raises(ConfigError, match="'turtlebot2' has differential_drive; this is for thrusters"):
        BatchVecEnv(
            load_robot("turtlebot2"),
            load_task("go_to_pose"),
            load_scenario("nominal"),
            worlds=2,
            seed=1,
            action_space="wrench",
        )
