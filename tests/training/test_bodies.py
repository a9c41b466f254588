"""Networks that ask for a wrench of thrusters by degrees: one for bodies that differ, and for other robots."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.wrench_shares import BODY_TERMS, WrenchShares, body_terms
from fulmar_core.loop.policy_bundle import read_golden
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from policy_server.policy import Policy
from training.behavior_cloning import BodyExpert
from training.bodies import KnownBodies
from training.evaluator import evaluate_in_batch
from training.export import export
from training.network import load_network
from training.run_folder import CHECKPOINT_FILE, NETWORK_FILE
from training.settings import load_training_settings
from training.train import train
from training.vec_env import BatchVecEnv

ROBOT, TASK = load_robot("cubesat_8"), load_task("go_to_pose_3d")
ANY = load_scenario("morphologies")


def worlds_of(count=4, scenario=ANY, **more):
    return BatchVecEnv(
        ROBOT, TASK, scenario, worlds=count, seed=3, body_inputs=True, action_space="wrench", **more
    )


def small():
    settings = load_training_settings(ROBOT, TASK, "free_flyer_bodies")
    algorithm = replace(settings.algorithm, steps=8, minibatch=64, epochs=1, hidden=(16,))
    return replace(settings, algorithm=algorithm, worlds=16, evaluate_every_s=1e6)


@pytest.fixture(scope="module", autouse=True)
def no_evaluation():
    """Episodes of a minute and a half take longer than all else here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("training.train.held_out_evaluator", lambda *_: lambda network: (0.5, 0.5))
        yield


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    train(ROBOT, TASK, small(), seed=1, out=folder, updates=1)
    return folder


def test_each_world_opens_its_own_thrusters_for_a_wrench():
    env = worlds_of()
    env.reset()
    assert env.action_space.shape == (6,)
    shares = np.random.default_rng(1).uniform(-1.0, 1.0, (4, 6)).astype(np.float32)
    effect = np.moveaxis(np.asarray(env.simulation.world.effects, float), (0, 1), (2, 1))
    env.step(shares)
    expected = WrenchShares.of(effect).openings(shares)
    np.testing.assert_allclose(env.simulation.command, expected, atol=1e-5)


def test_what_a_body_can_do_is_seen_and_follows_each_new_episode():
    env = worlds_of()
    seen = env.reset()
    assert seen.shape == (4, len(env.simulation.observer.names) + BODY_TERMS)
    np.testing.assert_allclose(seen[:, -BODY_TERMS:], env.bodies.terms)
    before = env.bodies.terms.copy()
    env.begin_anew(np.array([2]))
    after = KnownBodies.of_worlds(ROBOT, env.simulation.world).terms
    np.testing.assert_array_equal(env.bodies.terms, after)
    assert (after[2] != before[2]).all()
    np.testing.assert_array_equal(np.delete(after, 2, axis=0), np.delete(before, 2, axis=0))


def test_worlds_of_the_robots_own_body_share_one_allocation():
    env = worlds_of(scenario=load_scenario("nominal"))
    env.reset()
    np.testing.assert_allclose(env.bodies.terms, body_terms(ROBOT), rtol=1e-6)


@pytest.mark.parametrize("name", [pytest.param("cubesat_8", marks=pytest.mark.slow), "int_ball2"])
def test_one_run_gives_a_bundle_for_each_robot_with_its_own_allocation(run, name, tmp_path):
    passport = export(run, tmp_path / "bundle", name)
    robot, network = load_robot(name), load_network(run / NETWORK_FILE)
    Policy(tmp_path / "bundle", robot, TASK)  # runs the golden vectors through ONNX
    assert (passport.robot, len(passport.actuator_names)) == (name, 8)
    assert passport.training.get("trained_on") == (None if name == "cubesat_8" else "cubesat_8")
    golden, shares = read_golden(tmp_path / "bundle"), WrenchShares.of_robot(robot)
    seen = np.hstack((golden.observations, np.tile(body_terms(robot), (len(golden.observations), 1))))
    import torch

    with torch.inference_mode():
        features = (torch.as_tensor(seen, dtype=torch.float32) - network.mean) / network.scale
        wanted = network.layers(features.clamp(-network.plan.limit, network.plan.limit)).clamp(-1.0, 1.0)
    np.testing.assert_allclose(golden.commands, shares.openings(wanted.double().numpy()), atol=2e-5)


def test_a_network_of_single_actuators_is_not_for_another_robot(tmp_path):
    settings = replace(small(), action_space="actuators", body_inputs=False, scenario="nominal")
    train(ROBOT, TASK, settings, seed=1, out=tmp_path / "run", updates=1)
    with pytest.raises(ConfigError, match=r"gives commands of single actuators.*action_space: wrench"):
        export(tmp_path / "run", tmp_path / "bundle", "int_ball2")


def test_a_network_for_many_bodies_does_for_each_what_it_does_for_it_alone(run):
    network, env = load_network(run / NETWORK_FILE), worlds_of()
    seen = env.reset()[:, :-BODY_TERMS]
    together, _, _ = network.for_bodies(env.bodies).infer(seen)
    for number in range(4):
        alone = KnownBodies.of_worlds(ROBOT, env.simulation.world, np.array([number]))
        np.testing.assert_allclose(
            network.for_bodies(alone).infer(seen[number : number + 1])[0][0], together[number], atol=1e-6
        )
    assert not np.allclose(together, network.infer(seen)[0], atol=1e-3), "the robot's own body is another"


def test_a_run_among_many_bodies_resumes_exactly(run, tmp_path):
    from training.checkpoint import load_checkpoint

    settings = small()
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    train(ROBOT, TASK, settings, seed=1, out=whole, updates=2)
    train(ROBOT, TASK, settings, seed=1, out=parts, updates=1)
    train(ROBOT, TASK, settings, seed=1, out=parts, updates=2, resume=True)
    ends = [
        load_checkpoint(each / CHECKPOINT_FILE, settings.algorithm, worlds_of(16))[0]
        for each in (whole, parts)
    ]
    for mine, theirs in zip(*(end.policy.state_dict().values() for end in ends), strict=True):
        assert (mine == theirs).all()


def test_an_evaluation_among_many_bodies_gives_the_network_each_of_them(run, monkeypatch):
    given = []
    original = KnownBodies.of_episodes
    monkeypatch.setattr(
        KnownBodies, "of_episodes", lambda *args, **more: given.append(original(*args, **more)) or given[-1]
    )
    task = replace(TASK, episode_s=1.0)
    found = evaluate_in_batch(load_network(run / NETWORK_FILE), ROBOT, task, ANY, episodes=3, seed=3)
    assert found["episodes"] == 3
    np.testing.assert_allclose(given[0].terms, worlds_of(3).bodies.terms, rtol=1e-5)


def test_the_law_that_is_cloned_asks_each_body_for_what_it_can_do():
    env = worlds_of(16)
    seen = env.reset()
    shares = BodyExpert(env).actions(seen)
    assert shares.shape == (16, 6)
    assert np.abs(shares).max() <= 1.0
    # At rest the PD law pushes along the way to the goal, whatever the body.
    way = seen[:, :3]
    push = shares[:, :3] * env.bodies.terms[:, :3]
    along = np.sum(way * push, axis=1) / np.linalg.norm(way, axis=1) / np.linalg.norm(push, axis=1)
    assert along.min() > 0.99


def test_the_law_that_is_cloned_is_the_robots_own_for_its_own_body():
    env = worlds_of(4, scenario=load_scenario("nominal"))
    seen = env.reset()
    env.step(np.full((4, 6), 0.3, np.float32))
    law = load_classical(ROBOT, TASK, law="pd")
    law.allocation = SimpleNamespace(best=lambda wrench, alive: wrench)
    wrench = law.command(env.inputs()).reshape(4, 2, 3)
    limits = WrenchShares.of_robot(ROBOT).limits.reshape(2, 3)
    expected = wrench / limits
    expected /= np.maximum(1.0, np.abs(expected).max(axis=-1, keepdims=True))
    np.testing.assert_allclose(BodyExpert(env).actions(seen), expected.reshape(4, 6), atol=1e-5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"action_space": "actuators"}, "'body_inputs' need 'action_space: wrench'"),
        ({"disturbance_inputs": True}, "go without 'disturbance_inputs'"),
    ],
)
def test_settings_that_do_not_go_together_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        replace(small(), **change)


def test_off_policy_learners_ask_for_no_wrench():
    td3 = load_training_settings(load_robot("turtlebot2"), load_task("go_to_pose"), "td3")
    with pytest.raises(ValueError, match="is for ppo and recurrent_ppo, not for td3"):
        replace(td3, action_space="wrench")


def test_a_wrench_of_valves_that_share_a_line_by_degrees_is_refused():
    robot = load_robot("floating_platform")
    shared = replace(robot, actuators=replace(robot.actuators, continuous=True))
    with pytest.raises(ConfigError, match=r"'action_space: wrench': .* share no pressure line"):
        BatchVecEnv(
            shared, load_task("go_to_pose"), load_scenario("nominal"), worlds=1, seed=1, action_space="wrench"
        )
