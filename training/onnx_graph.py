"""Small ONNX graphs, written as expressions of tensors of shape (rows, columns)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import onnx
import onnxruntime
from onnx import TensorProto, helper, numpy_helper

from policy_server.inference import open_network

OLDEST_OPSET = 13  # every operator used here means the same from there on
OPSET = 18
IR_VERSION = 10  # the newest that every onnxruntime since 1.18 reads
ROWS = "worlds"


class Tensor:
    """A named value of a graph; arithmetic adds nodes."""

    def __init__(self, graph: Graph, name: str) -> None:
        self.graph, self.name = graph, name

    def __add__(self, other: Tensor) -> Tensor:
        return self.graph.node("Add", self, other)

    def __sub__(self, other: Tensor) -> Tensor:
        return self.graph.node("Sub", self, other)

    def __mul__(self, other: Tensor) -> Tensor:
        return self.graph.node("Mul", self, other)

    def __truediv__(self, other: Tensor) -> Tensor:
        return self.graph.node("Div", self, other)

    def __gt__(self, other: Tensor) -> Tensor:
        return self.graph.node("Greater", self, other)

    def columns(self, indices: Iterable[int]) -> Tensor:
        """Take some columns."""
        return self.graph.node("Gather", self, self.graph.constant(np.array(list(indices), np.int64)), axis=1)


class Graph:
    """Nodes in the order of their writing, with their constants."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.constants: list[onnx.TensorProto] = []
        self._inputs: list[onnx.ValueInfoProto] = []
        self._outputs: list[onnx.ValueInfoProto] = []

    def input(self, name: str, width: int) -> Tensor:
        """Declare an input."""
        self._inputs.append(_rows_of(name, width))
        return Tensor(self, name)

    def output(self, name: str, value: Tensor, width: int) -> None:
        """Give a value out under a name."""
        self.nodes.append(helper.make_node("Identity", [value.name], [name]))
        self._outputs.append(_rows_of(name, width))

    def constant(self, value: Any) -> Tensor:
        """Add a constant; what is no array becomes float32."""
        array = value if isinstance(value, np.ndarray) else np.asarray(value, np.float32)
        name = f"constant_{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(np.ascontiguousarray(array), name))
        return Tensor(self, name)

    def node(self, operator: str, *inputs: Tensor, **attributes: Any) -> Tensor:
        """Add a node with one output."""
        name = f"value_{len(self.nodes)}"
        self.nodes.append(
            helper.make_node(operator, [tensor.name for tensor in inputs], [name], **attributes)
        )
        return Tensor(self, name)

    def concatenate(self, columns: Sequence[Tensor]) -> Tensor:
        """Put columns side by side."""
        return self.node("Concat", *columns, axis=1)

    def clip(self, value: Tensor, limit: float) -> Tensor:
        """Cut to ±limit."""
        return self.node("Clip", value, self.constant(-limit), self.constant(limit))

    def where(self, condition: Tensor, yes: Tensor, no: Tensor) -> Tensor:
        """Choose by element."""
        return self.node("Where", condition, yes, no)

    def model(
        self, opsets: Sequence[onnx.OperatorSetIdProto] = (), ir_version: int = IR_VERSION
    ) -> onnx.ModelProto:
        """The graph as a model of our operator set, or of the given ones."""
        graph = helper.make_graph(self.nodes, "policy", self._inputs, self._outputs, self.constants)
        return helper.make_model(
            graph, opset_imports=list(opsets) or [helper.make_opsetid("", OPSET)], ir_version=ir_version
        )


def open_model(model: onnx.ModelProto) -> onnxruntime.InferenceSession:
    """Load a model for inference in this thread."""
    return open_network(model.SerializeToString())


def _rows_of(name: str, width: int) -> onnx.ValueInfoProto:
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, [ROWS, width])
