"""What a robot runs is what the learner would do, for every algorithm, also through ONNX."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from stable_baselines3.common.vec_env import VecNormalize

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.tasks.observation import Observer
from fulmar_core.worlds.scenario import load_scenario
from policy_server.policy import Policy
from tests.policy_server.observed import inputs_seeing
from training.deploy import deployed_network
from training.export import export
from training.learners import build_learner, callbacks_of
from training.network import NetworkController, load_network, save_network
from training.run_folder import NETWORK_FILE
from training.settings import load_training_settings
from training.train import train
from training.vec_env import BatchVecEnv

ROBOT, TASK = load_robot("turtlebot2"), load_task("go_to_position")
NAMES = Observer(ROBOT, TASK).names
ALGORITHMS = ["differential_drive", "recurrent_ppo", "sac", "td3"]
ROWS = 5


def small(name):
    settings = load_training_settings(ROBOT, TASK, name)
    algorithm = settings.algorithm
    if hasattr(algorithm, "epochs"):
        algorithm = replace(algorithm, steps=8, minibatch=64, epochs=1, hidden=(8, 8))
    else:
        algorithm = replace(
            algorithm, buffer=2000, minibatch=32, first_steps=64, gradient_steps=1, hidden=(8,)
        )
    if hasattr(algorithm, "memory"):
        algorithm = replace(algorithm, memory=6)
    return replace(settings, algorithm=algorithm, worlds=16, evaluate_every_s=1e6)


@pytest.fixture(scope="module")
def learners():
    """One learner of each kind after a few updates, with its normaliser."""
    made = {}
    for name in ALGORITHMS:
        worlds = BatchVecEnv(ROBOT, TASK, load_scenario("uncertain"), worlds=16, seed=3)
        env = VecNormalize(worlds, norm_reward=False)
        learner = build_learner(small(name).algorithm, env, seed=3)
        learner.learn(16 * 16, callback=callbacks_of(learner))
        made[name] = learner, env
    return made


def sights(count):
    return np.random.default_rng(4).normal(size=(count, ROWS, len(NAMES))).astype(np.float32)


@pytest.mark.parametrize("name", ALGORITHMS)
def test_commands_are_the_deterministic_actions_in_the_units_of_the_actuators(learners, name):
    learner, env = learners[name]
    network = deployed_network(learner, env, ROBOT.actuators.scale)
    controller = NetworkController(network, ROBOT, TASK, 10.0)
    state, begins = None, np.ones(ROWS, dtype=bool)
    for seen in sights(4):
        actions, state = learner.predict(
            env.normalize_obs(seen), state=state, episode_start=begins, deterministic=True
        )
        begins = np.zeros(ROWS, dtype=bool)
        np.testing.assert_allclose(
            controller.act(inputs_seeing(seen)), actions * ROBOT.actuators.scale, atol=2e-5
        )
    assert np.ptp(actions) > 0.0


@pytest.mark.parametrize("name", ALGORITHMS)
def test_a_saved_network_is_the_same_after_loading(learners, name, tmp_path):
    network = deployed_network(*learners[name], ROBOT.actuators.scale)
    save_network(network, tmp_path / "network.pt")
    loaded, seen = load_network(tmp_path / "network.pt"), sights(1)[0]
    assert loaded.plan == network.plan
    for ours, theirs in zip(network.infer(seen), loaded.infer(seen), strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_only_a_recurrent_policy_has_memory_and_it_forgets_on_reset(learners):
    plans = {name: deployed_network(*made, ROBOT.actuators.scale).plan for name, made in learners.items()}
    assert {name: plan.memory for name, plan in plans.items() if plan.memory} == {"recurrent_ppo": 12}
    network = deployed_network(*learners["recurrent_ppo"], ROBOT.actuators.scale)
    controller, seen = NetworkController(network, ROBOT, TASK, 10.0), inputs_seeing(sights(1)[0])
    first, second = controller.act(seen), controller.act(seen)
    assert not np.array_equal(first, second)
    controller.reset()
    np.testing.assert_array_equal(controller.act(seen), first)
    assert controller.act(inputs_seeing(sights(1)[0, 0])).shape == (1, 2)


@pytest.mark.parametrize("name", [pytest.param("recurrent_ppo", marks=pytest.mark.slow), "sac"])
def test_a_bundle_commands_what_the_network_does_from_the_first_command_to_the_last(
    learners, name, tmp_path, monkeypatch
):
    monkeypatch.setattr("training.train.held_out_evaluator", lambda *_: lambda network: (0.5, 0.5))
    train(ROBOT, TASK, small(name), seed=1, out=tmp_path / "run", updates=2)
    network = deployed_network(*learners[name], ROBOT.actuators.scale)
    save_network(network, tmp_path / "run" / NETWORK_FILE)
    passport = export(tmp_path / "run", tmp_path / "bundle")
    assert (passport.action, passport.memory) == ("continuous", network.plan.memory)
    assert passport.command_scale == tuple(ROBOT.actuators.scale)
    served, known = Policy(tmp_path / "bundle", ROBOT, TASK), NetworkController(network, ROBOT, TASK, 10.0)
    for seen in map(inputs_seeing, sights(4)):
        np.testing.assert_allclose(served.act(seen), known.act(seen), atol=1e-5)
    one = [inputs_seeing(row) for row in sights(4)[:, 0]]
    served.reset()
    known.reset()
    np.testing.assert_allclose(
        [served.act(seen) for seen in one], [known.act(seen) for seen in one], atol=1e-5
    )
