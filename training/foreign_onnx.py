"""Policies of other learners that come as ONNX."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
import onnxruntime
from onnx import compose, version_converter

from fulmar_core.config.bounded_file import read_bounded
from fulmar_core.config.errors import ConfigError
from fulmar_core.loop.policy_bundle import MAX_BYTES
from training.onnx_graph import IR_VERSION, OLDEST_OPSET, OPSET, ROWS, Graph, Tensor, open_model


class ForeignOnnx:
    """A network with one input, whose first output is what counts (as in RoboRAN's deployment stack).

    Attributes:
        inputs: Width of the input.
        outputs: Width of the first output.
    """

    def __init__(self, path: Path) -> None:
        """Read a model.

        Args:
            path: The `.onnx` file.

        Raises:
            ConfigError: Not readable, too large, with weights in other files, or not of one input (rows, terms).
        """
        try:
            content = read_bounded(path, MAX_BYTES)
        except OSError as error:
            raise ConfigError(f"{path}: cannot be read: {error.strerror or error}.") from error
        self._path = path
        try:
            model = onnx.load_model_from_string(content)
            if any(part.data_location == onnx.TensorProto.EXTERNAL for part in model.graph.initializer):
                raise ConfigError(f"{path}: keeps weights in other files. Export it as one file.")
            versions = {entry.domain: entry.version for entry in model.opset_import}
            if versions.get("", OPSET) < OLDEST_OPSET:
                model = version_converter.convert_version(model, OPSET)
            _free_rows(model)
            self._model = compose.add_prefix(model, "imported/")
            self._session = open_model(self._model)
        except ConfigError:
            raise
        except Exception as error:  # protobuf, onnx and onnxruntime each have exceptions of their own
            reason = (str(error).splitlines() or [type(error).__name__])[0]
            raise ConfigError(f"{path}: is no ONNX model that can be run here: {reason}.") from error
        self.inputs = self._width(self._session.get_inputs(), "input")
        self.outputs = self._width(self._session.get_outputs()[:1], "output")

    def infer(self, observation: np.ndarray) -> np.ndarray:
        """Run the network as it came; shapes (rows, inputs) and (rows, outputs)."""
        source, sink = self._session.get_inputs()[0].name, self._session.get_outputs()[0].name
        try:
            (out,) = self._session.run([sink], {source: observation})
        except Exception as error:
            reason = (str(error).splitlines() or [type(error).__name__])[0]
            raise ConfigError(
                f"{self._path}: cannot be run on {len(observation)} rows at once: {reason}. "
                "Export it with a dynamic first axis."
            ) from error
        if out.shape != (len(observation), self.outputs):
            raise ConfigError(
                f"{self._path}: gives shape {list(out.shape)} for {len(observation)} rows, it must give one row of "
                f"{self.outputs} for each. Export it with a dynamic first axis."
            )
        return np.asarray(out)

    def write(self, graph: Graph, observation: Tensor) -> Tensor:
        """Add the network's nodes to a graph, and return its first output."""
        source, sink = self._session.get_inputs()[0].name, self._session.get_outputs()[0].name
        graph.nodes.append(onnx.helper.make_node("Identity", [observation.name], [source]))
        graph.nodes.extend(self._model.graph.node)
        graph.constants.extend(self._model.graph.initializer)
        return Tensor(graph, sink)

    def model(self, graph: Graph) -> onnx.ModelProto:
        """A graph with this network in it as a model of this network's operators."""
        model = graph.model(self._model.opset_import, max(IR_VERSION, self._model.ir_version))
        model.functions.extend(self._model.functions)
        return model

    def _width(self, nodes: list[onnxruntime.NodeArg], what: str) -> int:
        if len(nodes) != 1:
            raise ConfigError(
                f"{self._path}: has {len(nodes)} {what}s; a policy without memory has one. "
                "Recurrent policies are not imported."
            )
        shape, kind = nodes[0].shape, nodes[0].type
        if len(shape) != 2 or not isinstance(shape[1], int) or kind != "tensor(float)":
            raise ConfigError(
                f"{self._path}: {what} '{nodes[0].name}' is a {kind} of shape {shape}; it must be a tensor(float) of "
                "shape (rows, a fixed number)."
            )
        return shape[1]


def _free_rows(model: onnx.ModelProto) -> None:
    """Let the first axis be of any length: many exporters fix it to the one row of their example."""
    del model.graph.value_info[:]  # inferred for that one row
    for value in (*model.graph.input, *model.graph.output):
        shape = value.type.tensor_type.shape
        if len(shape.dim) == 2:
            shape.dim[0].dim_param = ROWS
