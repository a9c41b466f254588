"""Bundles and networks that the tests of policies share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import BundleError
from fulmar_core.loop.policy_bundle import (
    NETWORK,
    Golden,
    read_golden,
    read_passport,
    write_bundle,
)
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.tasks.observation import Observer
from policy_server.controllers import policies_directory
from policy_server.policy import Policy

ROBOT, TASK = load_robot("floating_platform"), load_task("go_to_pose")
ROLLING, ROLLING_TASK = load_robot("turtlebot2"), load_task("go_to_position")
SHIPPED = policies_directory() / "floating_platform_go_to_pose"


def load(folder, **kwargs):
    return Policy(folder, ROBOT, TASK, **kwargs)


def refusal(folder, **kwargs) -> str:
    with pytest.raises(BundleError) as caught:
        load(folder, **kwargs)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def reseal(folder, *, network=None, golden=None, **passport):
    """What an exporter with a mistake would leave: other content, every hash in order."""
    write_bundle(
        folder,
        network or (folder / NETWORK).read_bytes(),
        golden or read_golden(folder),
        replace(read_passport(folder), **passport),
    )


def linear_network(
    *, inputs=10, outputs=8, batch="worlds", names=("observation", "command", "logits"), extra=False
):
    """A small valid ONNX model of the bundle's kind, with one thing different."""
    onnx = pytest.importorskip("onnx")
    helper, numpy_helper = onnx.helper, onnx.numpy_helper
    kind = onnx.TensorProto.FLOAT
    weights = np.random.default_rng(1).normal(size=(inputs, outputs)).astype(np.float32)
    nodes = [
        helper.make_node("MatMul", [names[0], "w"], [names[2]]),
        helper.make_node("Greater", [names[2], "zero"], ["open"]),
        helper.make_node("Cast", ["open"], [names[1]], to=kind),
    ]
    takes = [helper.make_tensor_value_info(names[0], kind, [batch, inputs])]
    if extra:
        takes.append(helper.make_tensor_value_info("zero", kind, [1]))
    constants = [numpy_helper.from_array(weights, "w")]
    if not extra:
        constants.append(numpy_helper.from_array(np.zeros(1, np.float32), "zero"))
    gives = [helper.make_tensor_value_info(name, kind, [batch, outputs]) for name in names[1:]]
    graph = helper.make_graph(nodes, "g", takes, gives, constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=9)
    observations = np.random.default_rng(2).normal(size=(4, inputs)).astype(np.float32)
    logits, none = observations @ weights, np.zeros((4, 0), np.float32)
    return model.SerializeToString(), Golden(
        observations, none, (logits > 0).astype(np.float32), logits, none
    )


def counting_network(*, gives="next_memory", memory=2):
    """An ONNX model for the turtlebot: its memory counts calls, and its raw outputs are the memory it was given."""
    onnx = pytest.importorskip("onnx")
    helper, numpy_helper = onnx.helper, onnx.numpy_helper
    kind, inputs = onnx.TensorProto.FLOAT, len(Observer(ROLLING, ROLLING_TASK).names)
    scale = np.asarray(ROLLING.actuators.scale, np.float32)
    nodes = [
        helper.make_node("MatMul", ["observation", "nothing"], ["zeros"]),
        helper.make_node("Add", ["zeros", "memory"], ["logits"]),
        helper.make_node("Clip", ["logits", "low", "high"], ["share"]),
        helper.make_node("Mul", ["share", "scale"], ["command"]),
        helper.make_node("Add", ["memory", "quarter"], [gives]),
    ]
    constants = [
        numpy_helper.from_array(np.zeros((inputs, 2), np.float32), "nothing"),
        numpy_helper.from_array(np.float32(-1.0), "low"),
        numpy_helper.from_array(np.float32(1.0), "high"),
        numpy_helper.from_array(scale, "scale"),
        numpy_helper.from_array(np.float32(0.25), "quarter"),
    ]
    takes = [
        helper.make_tensor_value_info("observation", kind, ["worlds", inputs]),
        helper.make_tensor_value_info("memory", kind, ["worlds", memory]),
    ]
    results = [
        helper.make_tensor_value_info(name, kind, ["worlds", 2]) for name in ("command", "logits", gives)
    ]
    graph = helper.make_graph(nodes, "g", takes, results, constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=9)
    seen = np.random.default_rng(2).normal(size=(4, inputs)).astype(np.float32)
    before = np.random.default_rng(3).normal(size=(4, 2)).astype(np.float32)
    command = np.clip(before, -1.0, 1.0) * scale
    return model.SerializeToString(), Golden(seen, before, command, before, before + np.float32(0.25))
