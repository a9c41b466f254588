"""A bundle as a controller: the shipped one is taken, every broken one is refused with its own words."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import onnxruntime
import pytest

from fulmar_core.config.errors import BundleError
from fulmar_core.controllers.disturbance_inputs import ESTIMATOR, disturbance_terms
from fulmar_core.estimators.actuator_health.actuator_estimator import ActuatorEstimate
from fulmar_core.estimators.actuator_health.thruster_health import Health
from fulmar_core.loop.bundle_signature import make_keys, sign_bundle
from fulmar_core.loop.policy_bundle import (
    GOLDEN,
    NETWORK,
    PASSPORT,
    read_golden,
    read_passport,
)
from fulmar_core.states.planar import PlanarState, at_rest
from fulmar_core.tasks.goal import goal_at
from fulmar_core.tasks.observation import Observer
from policy_server.controllers import shipped_policies, shipped_policy
from tests.inputs import inputs_at
from tests.policy_server.bundles import (
    ROBOT,
    SHIPPED,
    TASK,
    linear_network,
    load,
    refusal,
    reseal,
)
from tests.policy_server.observed import inputs_seeing

CHECKOUT = Path(__file__).resolve().parents[2]


def test_the_shipped_bundle_is_accepted():
    policy = load(SHIPPED)
    assert policy.control_hz == ROBOT.timing.control_hz
    assert policy.passport.observation_names == TASK.observation_names
    assert policy.estimator is None


def test_the_shipped_bundle_is_found_by_robot_and_task_and_no_other_is():
    assert shipped_policy("floating_platform", "go_to_pose") == SHIPPED
    assert SHIPPED in shipped_policies()
    assert shipped_policy("floating_platform", "no_such_task") is None


def test_no_shipped_bundle_names_a_folder_of_the_machine_it_was_made_on():
    for bundle in shipped_policies():
        text = (bundle / NETWORK).read_bytes() + (bundle / PASSPORT).read_bytes()
        assert not any(place in text for place in (str(CHECKOUT).encode(), b"/home/", b"site-packages"))


def test_commands_are_zeros_and_ones_for_one_robot_and_for_many():
    policy, golden = load(SHIPPED), read_golden(SHIPPED)
    many = policy.act(inputs_seeing(golden.observations))
    assert many.shape == (len(golden.observations), 8)
    assert set(np.unique(many)) == {0.0, 1.0}
    np.testing.assert_array_equal(many, golden.commands)
    alone = [policy.act(inputs_seeing(row)) for row in golden.observations]
    assert alone[0].shape == (1, 8)
    np.testing.assert_array_equal(np.concatenate(alone), many)


def test_the_metadata_is_the_passport():
    metadata = load(SHIPPED).metadata()
    assert metadata == {"controller": "policy", **read_passport(SHIPPED).plain()}
    json.dumps(metadata, allow_nan=False)


def test_a_network_made_by_hand_is_as_good_as_an_exported_one(folder):
    network, golden = linear_network()
    reseal(folder, network=network, golden=golden)
    np.testing.assert_array_equal(load(folder).act(inputs_seeing(golden.observations)), golden.commands)


@pytest.fixture
def disturbed(folder):
    """A bundle of a network whose passport names estimated disturbances behind the observation."""
    names = TASK.observation_names + disturbance_terms(ROBOT)
    network, golden = linear_network(inputs=len(names))
    reseal(folder, network=network, golden=golden, observation_names=names)
    return folder


def test_a_network_whose_passport_names_disturbances_acts_on_the_estimate(disturbed):
    policy, session = load(disturbed), onnxruntime.InferenceSession(disturbed / NETWORK)
    assert policy.estimator == ESTIMATOR
    moved = at_rest(np.array([0.3, -0.2]), np.array([0.1, 0.0]), np.array([0.5, 2.0]))
    push, alive = np.array([[0.2, 0.0, -0.1], [0.0, 0.4, 0.0]]), np.ones((2, 8))
    alive[1, 3] = 0.0
    motion = np.stack([getattr(moved, name) for name in PlanarState.COLUMNS], axis=-1)
    health = Health(alive, alive, motion, push, np.zeros(2, dtype=bool))
    given = inputs_at(
        ROBOT,
        TASK,
        at_rest(np.zeros(2), np.zeros(2), np.zeros(2)),
        goal_at((1.0, 1.0, 0.0)),
        estimates=ActuatorEstimate(moved, push, alive, health),
    )
    observed = Observer(ROBOT, TASK)(moved, given.goal, given.previous)
    row = np.column_stack((observed, push, alive)).astype(np.float32)
    (expected,) = session.run(["command"], {"observation": row})
    np.testing.assert_array_equal(policy.act(given), expected)


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (
            TASK.observation_names + disturbance_terms(ROBOT)[:-1] + ("mystery",),
            "observation 21 is 'mystery'",
        ),
        (
            TASK.observation_names + tuple(f"mystery_{i}" for i in range(11)),
            "21 observation names, 10 are needed",
        ),
    ],
)
def test_further_inputs_of_other_names_are_refused_whatever_their_number(disturbed, names, words):
    reseal(disturbed, observation_names=names)
    assert words in refusal(disturbed)


@pytest.mark.parametrize("name", [NETWORK, GOLDEN, PASSPORT])
def test_a_missing_file_is_refused(folder, name):
    (folder / name).unlink()
    assert f"has no {name}" in refusal(folder)


@pytest.mark.parametrize("name", [NETWORK, GOLDEN])
def test_corrupted_bytes_are_refused(folder, name):
    content = bytearray((folder / name).read_bytes())
    content[len(content) // 2] ^= 0xFF
    (folder / name).write_bytes(content)
    assert "SHA-256" in refusal(folder)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"robot": "boat"}, "was trained for robot 'boat'"),
        ({"task": "go_to_position"}, "was trained for task 'go_to_position'"),
        ({"control_hz": 10.0}, "was trained at 10 Hz, but would run at 5 Hz"),
        ({"observation_names": TASK.observation_names[::-1]}, "observation 1 is"),
        ({"actuator_names": ROBOT.actuators.names[::-1]}, "actuator 1 is"),
        ({"action": "continuous"}, "gives continuous commands, 'floating_platform' takes on_off"),
        ({"command_scale": (2.0,) * 8}, "was trained for full commands of [2.0,"),
        ({"format": 0}, "has format 0"),
    ],
)
def test_a_policy_for_something_else_is_refused(folder, change, words):
    reseal(folder, **change)
    assert words in refusal(folder)


def test_the_rate_it_shall_run_at_counts_and_not_only_the_robots_own(folder):
    assert "would run at 50 Hz" in refusal(folder, control_hz=50.0)


def test_a_file_that_is_no_network_is_refused(folder):
    reseal(folder, network=b"no network at all")
    assert "onnxruntime refuses it" in refusal(folder)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"inputs": 9}, "'observation' has shape ['worlds', 9]"),
        ({"outputs": 7}, "'command' has shape ['worlds', 7]"),
        ({"batch": 1}, "'observation' has shape [1, 10]"),
        ({"names": ("obs", "command", "logits")}, "has no tensor 'observation', only obs"),
        ({"names": ("observation", "action", "logits")}, "has no tensor 'command', only action, logits"),
        ({"names": ("observation", "command", "scores")}, "has no tensor 'logits', only command, scores"),
        ({"extra": True}, "takes observation, zero; it must take 'observation' alone"),
    ],
)
def test_a_network_of_another_shape_is_refused(folder, wrong, words):
    network, _ = linear_network(**wrong)
    reseal(folder, network=network)
    assert words in refusal(folder)


def test_a_network_of_another_number_type_is_refused(folder):
    onnx = pytest.importorskip("onnx")
    model = onnx.load_from_string(linear_network()[0])
    model.graph.node[2].attribute[0].i = onnx.TensorProto.DOUBLE
    model.graph.output[0].type.tensor_type.elem_type = onnx.TensorProto.DOUBLE
    reseal(folder, network=model.SerializeToString())
    assert "'command' is a tensor(double), it must be a tensor(float)" in refusal(folder)


def test_a_network_that_breaks_while_running_is_refused(folder):
    onnx = pytest.importorskip("onnx")
    model = onnx.load_from_string(linear_network()[0])
    # The reshape asks for three worlds of eight, whatever comes in; only running it shows that.
    model.graph.node[0].output[0] = "raw"
    shape = onnx.numpy_helper.from_array(np.array([3, 8]), "three")
    model.graph.initializer.append(shape)
    model.graph.node.insert(1, onnx.helper.make_node("Reshape", ["raw", "three"], ["flat"]))
    model.graph.node.insert(2, onnx.helper.make_node("Identity", ["flat"], ["logits"]))
    reseal(folder, network=model.SerializeToString())
    assert "cannot be run" in refusal(folder) or "has shape [3, 8]" in refusal(folder)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda g: replace(g, logits=g.logits + np.float32(2e-4)),
            "differs from its golden vectors by 0.0002",
        ),
        (
            lambda g: replace(g, logits=np.full_like(g.logits, np.nan)),
            "differs from its golden vectors by nan",
        ),
        (lambda g: replace(g, commands=1.0 - g.commands), "gives other commands than its golden vectors"),
        (lambda g: replace(g, observations=g.observations.astype(float)), "'observations' is float64"),
        (
            lambda g: replace(g, observations=g.observations[:, :9]),
            "'observations' is float32 of shape (64, 9)",
        ),
        (lambda g: replace(g, logits=g.logits[:1]), "'logits' is float32 of shape (1, 8)"),
        (lambda g: replace(g, commands=g.commands[:, :7]), "'commands' is float32 of shape (64, 7)"),
        (
            lambda g: replace(g, observations=g.observations[:0]),
            "must be float32 of shape (at least 1, 10)",
        ),
        (lambda g: replace(g, observations=np.float32(1.0)), "'observations' is float32 of shape ()"),
    ],
)
def test_golden_vectors_that_do_not_fit_the_network_are_refused(folder, change, words):
    reseal(folder, golden=change(read_golden(folder)))
    assert words in refusal(folder)


def test_another_network_with_the_old_golden_vectors_is_refused(folder):
    network, _ = linear_network()
    reseal(folder, network=network)
    assert "differs from its golden vectors" in refusal(folder)


def test_a_network_whose_weights_are_no_numbers_is_refused_with_that_reason(folder):
    onnx = pytest.importorskip("onnx")
    network, golden = linear_network()
    model = onnx.load_from_string(network)
    weights = np.full((10, 8), np.nan, np.float32)
    model.graph.initializer[0].CopyFrom(onnx.numpy_helper.from_array(weights, "w"))
    reseal(folder, network=model.SerializeToString(), golden=golden)
    assert "its output is not a number in 32 of 64 values. Are all weights finite?" in refusal(folder)


def test_a_network_that_asks_for_more_memory_than_there_may_be_is_refused(folder):
    """A few bytes that are 1.3 GB once it runs: 5 million zeros for each of the golden observations."""
    onnx = pytest.importorskip("onnx")
    make, constant = onnx.helper.make_node, onnx.numpy_helper.from_array
    network, _ = linear_network()
    model = onnx.load_from_string(network)
    model.graph.initializer.extend([constant(np.array([5_000_000]), "many"), constant(np.array([1]), "axis")])
    model.graph.node[0].output[0] = "raw"
    for node in (
        make("Add", ["raw", "most"], ["logits"]),
        make("ReduceMax", ["rows", "axis"], ["most"]),
        make("Expand", ["zero", "size"], ["rows"]),
        make("Concat", ["worlds", "many"], ["size"], axis=0),
        make("Shape", ["observation"], ["worlds"], start=0, end=1),
    ):
        model.graph.node.insert(1, node)
    reseal(folder, network=model.SerializeToString())
    assert "cannot be run" in refusal(folder)


def test_a_bundle_without_a_trusted_signature_is_no_policy(folder, tmp_path):
    make_keys(tmp_path / "private.pem", tmp_path / "public.pem")
    assert "is not signed, and this robot insists on it" in refusal(folder, trusted=tmp_path / "public.pem")
    sign_bundle(folder, tmp_path / "private.pem")
    load(folder, trusted=tmp_path / "public.pem")


def test_rounding_of_another_processor_is_no_reason_to_refuse(folder):
    golden = read_golden(folder)
    reseal(folder, golden=replace(golden, logits=golden.logits + np.float32(5e-5)))
    load(folder)


def test_what_was_verified_is_what_runs_though_the_files_are_exchanged_afterwards(
    folder, tmp_path, monkeypatch
):
    """A forger who writes as soon as the signature was checked: other network, golden vectors and passport, all hashes
    in order."""
    pytest.importorskip("cryptography")
    from fulmar_core.loop.bundle_signature import make_keys, sign_bundle, verify_bundle

    make_keys(tmp_path / "private.pem", tmp_path / "lab.pem")
    sign_bundle(folder, tmp_path / "private.pem")
    signed, network, golden = load(folder), *linear_network()

    def verify_then_exchange(bundle, trusted):
        name = verify_bundle(bundle, trusted)
        reseal(folder, network=network, golden=golden)
        return name

    monkeypatch.setattr("policy_server.policy.verify_bundle", verify_then_exchange)
    policy = load(folder, trusted=tmp_path / "lab.pem")
    assert load(folder).passport != signed.passport  # they were exchanged
    assert policy.passport == signed.passport
    given = inputs_seeing(golden.observations)
    np.testing.assert_array_equal(policy.act(given), signed.act(given))
    with pytest.raises(BundleError, match="not signed"):
        load(folder, trusted=tmp_path / "lab.pem")
