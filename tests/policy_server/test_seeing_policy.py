"""Bundles with an image input: what passes, what is refused, and what the network gets."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import BundleError
from fulmar_core.controllers.controller import Inputs
from fulmar_core.loop.fallback import warm_up
from fulmar_core.loop.image_input import ImageInput
from fulmar_core.loop.policy_bundle import (
    FORMAT,
    GOLDEN,
    PASSPORT,
    Golden,
    Passport,
    read_bundle,
    read_passport,
    write_bundle,
)
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.tasks.observation import Observer
from policy_server.policy import Policy

ROBOT, TASK = load_robot("cubesat_8"), load_task("dock")
IMAGE = ImageInput.of(ROBOT.sensors.camera, every=5)
NAMES = Observer(ROBOT, TASK).names


def nearest_network(shape=IMAGE.shape):
    """An ONNX model that opens every nozzle by the inverse of the mean depth, and its answers."""
    onnx = pytest.importorskip("onnx")
    helper, numpy_helper = onnx.helper, onnx.numpy_helper
    kind, count = onnx.TensorProto.FLOAT, len(ROBOT.actuators.names)
    nodes = [
        helper.make_node("Div", ["one", "image"], ["near"]),
        helper.make_node("ReduceMean", ["near", "axes"], ["mean"], keepdims=0),
        helper.make_node("Unsqueeze", ["mean", "last"], ["column"]),
        helper.make_node("MatMul", ["observation", "nothing"], ["zeros"]),
        helper.make_node("Add", ["zeros", "column"], ["logits"]),
        helper.make_node("Clip", ["logits", "low", "high"], ["command"]),
    ]
    constants = [
        numpy_helper.from_array(np.float32(1.0), "one"),
        numpy_helper.from_array(np.float32(0.0), "low"),
        numpy_helper.from_array(np.float32(1.0), "high"),
        numpy_helper.from_array(np.array([1, 2, 3], np.int64), "axes"),
        numpy_helper.from_array(np.array([1], np.int64), "last"),
        numpy_helper.from_array(np.zeros((len(NAMES), count), np.float32), "nothing"),
    ]
    takes = [
        helper.make_tensor_value_info("observation", kind, ["worlds", len(NAMES)]),
        helper.make_tensor_value_info("image", kind, ["worlds", *shape]),
    ]
    gives = [helper.make_tensor_value_info(name, kind, ["worlds", count]) for name in ("command", "logits")]
    graph = helper.make_graph(nodes, "g", takes, gives, constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=9)
    images = np.random.default_rng(1).uniform(1.0, 9.0, (3, *shape)).astype(np.float32)
    shares = np.repeat((1.0 / images).mean(axis=(1, 2, 3))[:, None], count, axis=1)
    seen, none = np.zeros((3, len(NAMES)), np.float32), np.zeros((3, 0), np.float32)
    return model.SerializeToString(), Golden(seen, none, shares, shares, none, images)


def passport(image=IMAGE):
    scale = tuple(float(value) for value in ROBOT.actuators.scale)
    return Passport(
        FORMAT, ROBOT.name, TASK.name, 10.0, NAMES, ROBOT.actuators.names, "continuous", scale, 0, "", "", image=image
    )  # fmt: skip


@pytest.fixture
def folder(tmp_path):
    write_bundle(tmp_path / "bundle", *nearest_network(), passport())
    return tmp_path / "bundle"


def refusal(folder, robot=ROBOT) -> str:
    with pytest.raises(BundleError) as caught:
        Policy(folder, robot, TASK)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def inputs(depth):
    count = len(depth)
    form = TASK.state_type.unknown()
    return Inputs(
        form, None, np.zeros((count, len(NAMES))), np.zeros((count, 8)), None, 0, 0.1, {"camera_depth": depth}
    )


def test_the_passport_names_the_camera_and_the_scaling(folder):
    plain = json.loads((folder / PASSPORT).read_text())["image"]
    assert (plain["reading"], plain["width"], plain["every"]) == ("camera_depth", 320, 5)
    assert (plain["field_of_view"], plain["scaling"]) == (90.0, "0.5 / depth in m")
    assert read_passport(folder).image == IMAGE


def test_it_asks_for_images_and_acts_on_those_of_the_whole_camera(folder):
    policy = Policy(folder, ROBOT, TASK)
    assert policy.readings == ("camera_depth",)
    depth = np.full((2, 240, 320), 4.0, np.float32)
    depth[1] = np.inf
    np.testing.assert_allclose(policy.act(inputs(depth)), [[0.25] * 8, [0.0] * 8])


def test_its_golden_vectors_hold_images_and_are_small(folder):
    assert read_bundle(folder).golden().images.shape == (3, 1, 48, 64)
    assert (folder / GOLDEN).stat().st_size < 50_000


def test_it_is_warmed_up_by_a_camera_that_sees_nothing(folder):
    assert warm_up(Policy(folder, ROBOT, TASK), ROBOT, TASK).sha256 == read_passport(folder).sha256


def test_a_policy_that_sees_nothing_has_no_image_in_its_passport():
    assert "image" not in passport(None).plain()


def test_a_robot_with_another_camera_is_refused_in_one_line(folder):
    sensors = ROBOT.sensors
    blind = replace(ROBOT, sensors=replace(sensors, camera=None))
    assert f"policy '{folder}' needs the reading 'camera_depth'" in refusal(folder, blind)
    small = replace(ROBOT, sensors=replace(sensors, camera=replace(sensors.camera, width=64, height=64)))
    assert "'width' = 320; the camera of 'cubesat_8' has 64" in refusal(folder, small)


def test_a_network_for_images_of_another_size_is_refused(tmp_path):
    network, golden = nearest_network((1, 64, 64))
    write_bundle(tmp_path, network, golden, passport())
    assert "'image' has shape ['worlds', 1, 64, 64], the passport needs (any number, 1, 48, 64)" in refusal(
        tmp_path
    )


def test_golden_vectors_without_images_are_refused(folder):
    network, golden = nearest_network()
    write_bundle(folder, network, replace(golden, images=None), passport())
    assert "has no 'images', which the passport names" in refusal(folder)


def test_images_that_no_network_takes_are_refused(folder):
    network, golden = nearest_network()
    write_bundle(folder, network, golden, passport(None))
    assert "takes observation, image; it must take 'observation' alone" in refusal(folder)


def test_images_that_give_other_commands_than_golden_are_refused(folder):
    network, golden = nearest_network()
    write_bundle(folder, network, replace(golden, images=2.0 * golden.images), passport())
    assert "differs from its golden vectors" in refusal(folder)


def test_an_image_in_the_passport_that_has_no_meaning_is_refused(folder):
    values = json.loads((folder / PASSPORT).read_text())
    values["image"]["every"] = 2
    (folder / PASSPORT).write_text(json.dumps(values))
    with pytest.raises(
        BundleError, match=r"'image' has no meaning: 'every' = 2 must be odd.*Export the policy again"
    ):
        read_passport(folder)
