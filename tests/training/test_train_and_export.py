"""From a learner to a bundle: the same commands at every station."""

from __future__ import annotations

import inspect
import json
import os
import shutil
import signal
from dataclasses import replace

import numpy as np
import pytest
import torch

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.seeds import EVALUATION_SEED, HELD_OUT_SEED
from fulmar_core.loop.policy_bundle import read_golden, read_passport
from policy_server.policy import Policy
from tests.policy_server.observed import inputs_seeing
from training.deploy import deployed_network
from training.evaluator import evaluate_in_mujoco
from training.export import export
from training.network import NetworkController, load_network
from training.run_folder import NETWORK_FILE, RUN_FILE, read_run_record
from training.train import train

SCALE = [1.0] * 8


@pytest.fixture
def run_copy(run, tmp_path):
    return shutil.copytree(run[0], tmp_path / "run")


def test_a_run_leaves_weights_a_record_and_curves(run):
    folder, record = run
    assert json.loads((folder / RUN_FILE).read_text()) == json.loads(json.dumps(record))
    assert (folder / NETWORK_FILE).is_file()
    assert list((folder / "tensorboard").rglob("events*"))


def test_the_record_says_what_was_done(run, small_settings):
    _, record = run
    assert (record["robot"], record["task"], record["seed"]) == ("floating_platform", "go_to_pose", 3)
    assert (record["command"], record["git_revision"]) == ("fulmar train", "abc")
    assert record["settings"]["worlds"] == small_settings.worlds
    assert record["steps"] % (32 * 16) == 0
    assert record["steps"] > 0


def test_the_time_limit_ends_a_run(run):
    _, record = run
    assert (
        2.0 <= record["curve"][-1]["wall_s"] < 12.0
    )  # the limit is 2 s; a check takes a while when others compute


def test_the_best_check_is_kept_and_not_the_last(run):
    _, record = run
    assert record["best"]["score"] == max(check["score"] for check in record["curve"])


def test_the_network_of_a_run_can_be_loaded_and_used(run, robot, task):
    network = load_network(run[0] / NETWORK_FILE)
    controller = NetworkController(network, robot, task, 5.0)
    assert network.plan.inputs == len(task.observation_names)
    assert controller.act(inputs_seeing(np.zeros((3, 10)))).shape == (3, 8)


def test_evaluation_writes_the_metrics_into_the_record(run_copy):
    figures = evaluate_in_mujoco(run_copy, episodes=2)
    mujoco = json.loads((run_copy / RUN_FILE).read_text())["mujoco"]
    assert mujoco["success_rate"] == figures["success_rate"]
    assert mujoco["episodes"] == 2


def test_the_bundle_of_a_run_is_accepted_by_the_policy_server(bundle, robot, task):
    folder, passport = bundle
    assert read_passport(folder) == passport
    assert Policy(folder, robot, task).control_hz == passport.control_hz == robot.timing.control_hz


def test_the_passport_records_how_the_policy_was_made(bundle, run):
    training = bundle[1].training
    assert (training["command"], training["seed"], training["git_revision"]) == ("fulmar train", 3, "abc")
    assert training["steps"] == run[1]["steps"]


def test_no_path_of_this_machine_is_in_the_network(bundle):
    content = (bundle[0] / "policy.onnx").read_bytes()
    assert not any(place in content for place in (b".py", b"site-packages", b"/home/"))


def test_golden_vectors_are_the_network_s_own_answers_to_many_situations(bundle, learner):
    golden = read_golden(bundle[0])
    commands, logits, _ = deployed_network(*learner, SCALE).infer(golden.observations)
    np.testing.assert_array_equal(golden.commands, commands)
    np.testing.assert_array_equal(golden.logits, logits)
    assert golden.observations.shape == (64, 10)
    assert len(np.unique(golden.observations, axis=0)) == 64


def test_the_onnx_command_is_stable_baselines_deterministic_prediction(bundle, learner, robot, task):
    ppo, env = learner
    rng = np.random.default_rng(9)
    seen = np.concatenate((read_golden(bundle[0]).observations, rng.normal(size=(500, 10)))).astype(
        np.float32
    )
    predicted, _ = ppo.predict(env.normalize_obs(seen), deterministic=True)
    served = Policy(bundle[0], robot, task).act(inputs_seeing(seen))
    # A logit within rounding of zero may fall either way; everywhere else not one valve may differ.
    _, logits, _ = deployed_network(ppo, env, SCALE).infer(seen)
    clear = np.abs(logits) > 1e-4
    assert clear.mean() > 0.98
    np.testing.assert_array_equal(served[clear], predicted[clear])
    assert 0.0 < served.mean() < 1.0


def test_far_observations_are_clipped_as_in_training(bundle, learner, robot, task):
    ppo, env = learner
    far = np.full((1, 10), 1e6, np.float32)
    predicted, _ = ppo.predict(env.normalize_obs(far), deterministic=True)
    np.testing.assert_array_equal(Policy(bundle[0], robot, task).act(inputs_seeing(far)), predicted)


def test_a_deployed_network_does_not_follow_the_learner_s_later_steps(learner):
    ppo, env = learner
    network = deployed_network(ppo, env, SCALE)
    linear = network.layers[0].weight
    assert linear.data_ptr() != ppo.policy.mlp_extractor.policy_net[0].weight.data_ptr()


@pytest.mark.parametrize("name", [RUN_FILE, NETWORK_FILE])
def test_a_folder_that_is_no_finished_run_is_refused(run_copy, tmp_path, name):
    (run_copy / name).unlink()
    with pytest.raises(ConfigError, match="no finished training run"):
        export(run_copy, tmp_path / "out")


@pytest.mark.parametrize("text", ["{", "[]", "{}", "3"])
def test_a_record_that_is_none_is_refused(run_copy, text):
    (run_copy / RUN_FILE).write_text(text)
    with pytest.raises(ConfigError, match=r"run\.json"):
        read_run_record(run_copy)


def test_weights_that_are_none_are_refused(run_copy, tmp_path):
    (run_copy / NETWORK_FILE).write_bytes(b"no weights")
    with pytest.raises(ConfigError, match=r"network\.pt"):
        export(run_copy, tmp_path / "out")


def test_a_network_for_another_number_of_terms_is_refused(run_copy, tmp_path):
    record = json.loads((run_copy / RUN_FILE).read_text())
    (run_copy / RUN_FILE).write_text(json.dumps(record | {"task": "go_to_position"}))
    with pytest.raises(ConfigError, match=r"the network takes 10 terms, .* now have 8"):
        export(run_copy, tmp_path / "out")


@pytest.mark.parametrize("seed", [HELD_OUT_SEED, EVALUATION_SEED, -1])
def test_a_seed_reserved_for_evaluation_is_rejected(robot, task, small_settings, tmp_path, seed):
    words = f"seed {seed} must not be negative, nor 2026 and 1000003, which are reserved for evaluation"
    with pytest.raises(ConfigError, match=words):
        train(robot, task, small_settings, seed=seed, out=tmp_path)


def test_evaluate_uses_a_seed_that_no_run_has_learned_from():
    from fulmar_cli.commands.evaluate import evaluate

    assert inspect.signature(evaluate).parameters["seed"].default == EVALUATION_SEED


def interrupted_after(checks, monkeypatch):
    """Let a person press Ctrl-C twice when this many checks have been done; they get worse."""
    scores = iter(range(checks, 0, -1))

    def evaluator_of(*_):
        def evaluate_network(network):
            score = next(scores, None)
            if score is None:
                raise KeyboardInterrupt
            return 0.5, float(score)

        return evaluate_network

    monkeypatch.setattr("training.train.held_out_evaluator", evaluator_of)


def test_an_interrupted_run_keeps_its_best_network_and_says_so(
    robot, task, small_settings, tmp_path, monkeypatch
):
    interrupted_after(2, monkeypatch)
    often = replace(small_settings, evaluate_every_s=0.01, time_limit_s=30.0)
    with pytest.raises(KeyboardInterrupt):
        train(robot, task, often, seed=3, out=tmp_path / "run", command="fulmar train")
    record = read_run_record(tmp_path / "run")
    assert record["interrupted"] is True
    assert record["best"] == record["curve"][0]
    assert len(record["curve"]) == 2
    passport = export(tmp_path / "run", tmp_path / "bundle")
    assert passport.training["interrupted"] is True


def test_a_run_interrupted_before_its_first_check_leaves_nothing_that_looks_finished(
    robot, task, small_settings, tmp_path, monkeypatch
):
    interrupted_after(0, monkeypatch)
    with pytest.raises(KeyboardInterrupt):
        train(robot, task, replace(small_settings, evaluate_every_s=0.01), seed=3, out=tmp_path / "run")
    with pytest.raises(ConfigError, match="no finished training run"):
        read_run_record(tmp_path / "run")


def test_ctrl_c_during_an_export_ends_it_when_the_exporter_is_done(run_copy, tmp_path, monkeypatch):
    """The exporter would take it for an error of its own."""
    exported, done = torch.onnx.export, []

    def pressed(*given, **options):
        os.kill(os.getpid(), signal.SIGINT)
        done.append(exported(*given, **options))
        return done[0]

    monkeypatch.setattr(torch.onnx, "export", pressed)
    with pytest.raises(KeyboardInterrupt):
        export(run_copy, tmp_path / "bundle")
    assert len(done) == 1
    assert not (tmp_path / "bundle").exists()


def test_the_passport_carries_the_result_of_mujoco(run_copy, bundle, tmp_path):
    assert "mujoco" not in bundle[1].training
    figures = evaluate_in_mujoco(run_copy, episodes=2)
    result = export(run_copy, tmp_path / "after").training["mujoco"]
    assert (result["seed"], result["scenario"], result["episodes"]) == (EVALUATION_SEED, "nominal", 2)
    assert result["success_rate"] == figures["success_rate"]
    shares = [f"{kind}{limit}_percent" for kind in ("PT", "OT") for limit in (5, 2, 1)]
    assert {name: result[name] for name in [*shares, "AAS"]} == {
        name: figures[name]["mean"] for name in [*shares, "AAS"]
    }
