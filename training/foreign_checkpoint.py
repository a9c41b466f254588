"""Policies of skrl and rl_games from their checkpoints: weights only, no pickled code runs."""

from __future__ import annotations

import io
import math
import pickle
import re
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import onnx
import torch
from torch import nn

from fulmar_core.config import yaml_text
from fulmar_core.config.bounded_file import CONFIG_BYTES, IMPORTED_BYTES, check_unpacked, read_bounded
from fulmar_core.config.errors import ConfigError, did_you_mean
from training.onnx_graph import Graph, Tensor

Format = Literal["skrl", "rl_games", "onnx"]
State = Mapping[str, torch.Tensor]

RL_GAMES_EPSILON = 1e-5  # rl_games/algos_torch/running_mean_std.py, under the root
SKRL_EPSILON = 1e-8  # skrl/resources/preprocessors/torch/running_standard_scaler.py, beside the root
NORMALISED_LIMIT = 5.0  # both of them cut there
# rl_games saves the mean reward as a scalar of NumPy. These types build numbers and nothing else.
_SCALAR = np.float32(0.0).__reduce__()[0]  # numpy's own function, under the names of NumPy 1 and 2
NUMBERS: list[Any] = [
    (_SCALAR, "numpy.core.multiarray.scalar"),
    (_SCALAR, "numpy._core.multiarray.scalar"),
    np.dtype,
    np.dtypes.Float32DType,
    np.dtypes.Float64DType,
    np.dtypes.Int64DType,
]


@dataclass(frozen=True)
class Checkpoint:
    """A feed-forward policy, apart from its activations."""

    format: Format
    layers: tuple[tuple[torch.Tensor, torch.Tensor], ...]  # weight (out, in) and bias (out,) of each
    mean: torch.Tensor  # of the observation, shape (inputs,)
    scale: torch.Tensor  # what the observation minus its mean is divided by, shape (inputs,)
    limit: float  # the normalised observation is cut to this

    @property
    def inputs(self) -> int:
        """Width of the observation."""
        return int(self.layers[0][0].shape[1])

    @property
    def outputs(self) -> int:
        """Width of the last layer."""
        return int(self.layers[-1][0].shape[0])


class FeedForward(nn.Module):
    """The network of a checkpoint: RoboRAN's observation in, the last layer's output out.

    Attributes:
        inputs: Width of the observation.
        outputs: Width of the output.
    """

    mean: torch.Tensor
    scale: torch.Tensor

    def __init__(self, checkpoint: Checkpoint, activations: Activations) -> None:
        super().__init__()
        self.inputs, self.outputs = checkpoint.inputs, checkpoint.outputs
        self.register_buffer("mean", checkpoint.mean.clone())
        self.register_buffer("scale", checkpoint.scale.clone())
        self._limit = checkpoint.limit
        stack: list[nn.Module] = []
        for weight, bias in checkpoint.layers:
            layer = nn.Linear(weight.shape[1], weight.shape[0])
            with torch.no_grad():
                layer.weight.copy_(weight)
                layer.bias.copy_(bias)
            stack += [layer, ACTIVATIONS[activations.hidden]()]
        last = [nn.Tanh()] if activations.output == "tanh" else []
        self.layers = nn.Sequential(*stack[:-1], *last)
        self.eval()

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        """Normalise and infer; shapes (worlds, inputs) and (worlds, outputs)."""
        normalised = (observation - self.mean) / self.scale
        out: torch.Tensor = self.layers(torch.clamp(normalised, -self._limit, self._limit))
        return out

    def infer(self, observation: np.ndarray) -> np.ndarray:
        """As `forward`, in NumPy."""
        with torch.inference_mode():
            return np.asarray(self(torch.as_tensor(observation)).numpy())

    def write(self, graph: Graph, observation: Tensor) -> Tensor:
        """Add the network's nodes to a graph, and return its output."""
        value = (observation - graph.constant(self.mean.numpy())) / graph.constant(self.scale.numpy())
        if math.isfinite(self._limit):
            value = graph.clip(value, self._limit)
        for layer in self.layers:
            if isinstance(layer, nn.Linear):
                weight = graph.constant(layer.weight.detach().numpy().T)
                value = graph.node("MatMul", value, weight) + graph.constant(layer.bias.detach().numpy())
            else:
                operator, attributes = OPERATORS[type(layer)]
                value = graph.node(operator, value, **attributes)
        return value

    def model(self, graph: Graph) -> onnx.ModelProto:
        """A graph with this network in it as a model."""
        return graph.model()


def read_checkpoint(path: Path, wanted: Format | None = None) -> Checkpoint:
    """Read the policy of a checkpoint.

    Args:
        path: What skrl or rl_games saved.
        wanted: Which of them; by default whichever the content says.

    Raises:
        ConfigError: Not readable, holds Python objects beside weights, is of another format, or holds no feed-forward
            policy.
    """
    content = _load(path)
    found: Format | None = None
    if isinstance(content, Mapping):
        found = "skrl" if "policy" in content else "rl_games" if "model" in content else None
    if found is None:
        keys = ", ".join(map(str, content)) if isinstance(content, Mapping) else type(content).__name__
        raise ConfigError(
            f"{path}: is no checkpoint of skrl (key 'policy') or rl_games (key 'model'); it holds {keys or 'nothing'}."
        )
    if wanted is not None and wanted != found:
        raise ConfigError(f"{path}: is a checkpoint of {found}, not of {wanted}. Give --format {found}.")
    return _skrl(content, path) if found == "skrl" else _rl_games(content["model"], path)


def _load(path: Path) -> Any:
    try:
        content = read_bounded(path, IMPORTED_BYTES)
        if zipfile.is_zipfile(io.BytesIO(content)):
            check_unpacked(content, IMPORTED_BYTES)
        with torch.serialization.safe_globals(NUMBERS):
            return torch.load(io.BytesIO(content), weights_only=True, map_location="cpu")
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror or error}.") from error
    except pickle.UnpicklingError as error:
        named = re.search(r"GLOBAL ([\w.]+)", str(error))
        if named is None and "Unsupported operand" in str(error):  # no pickle at all
            raise ConfigError(f"{path}: is no checkpoint that PyTorch reads.") from error
        what = f"the Python object '{named[1]}'" if named else "Python objects"
        raise ConfigError(
            f"{path}: holds {what}, which could run code when it is loaded; only weights are imported, and nothing was "
            "executed. Save the state dictionaries alone, or export the policy as ONNX."
        ) from error
    except Exception as error:  # damaged pickles and archives raise whatever they please
        raise ConfigError(
            f"{path}: is no checkpoint that PyTorch reads ({type(error).__name__}). "
            "Give a .pt of skrl, a .pth of rl_games or an .onnx file."
        ) from error


def _skrl(content: Mapping[str, Any], path: Path) -> Checkpoint:
    """`policy` holds the model, `state_preprocessor` the running statistics."""
    state = _tensors(content["policy"], path, "policy")
    _check_feed_forward(state, path)
    names = [name for name in _weights(state) if not _of_the_critic(name)]
    layers = tuple(_layer(state, name, path) for name in names)
    key = "state_preprocessor" if "state_preprocessor" in content else "observation_preprocessor"
    statistics = _tensors(content.get(key, {}), path, key)
    mean, deviation = _statistics(statistics, "running_mean", "running_variance", layers, path)
    scale = torch.sqrt(deviation) + SKRL_EPSILON if statistics else deviation
    return _checked(Checkpoint("skrl", layers, mean, scale, _limit(statistics)), path)


def _rl_games(content: Any, path: Path) -> Checkpoint:
    """`model` holds the network under `a2c_network` and the statistics under `running_mean_std`."""
    state = {
        name.replace("_orig_mod.", ""): value for name, value in _tensors(content, path, "model").items()
    }
    network = {name.split("a2c_network.", 1)[1]: v for name, v in state.items() if "a2c_network." in name}
    _check_feed_forward(network, path)
    hidden = [name for name in _weights(network) if name.startswith("actor_mlp.")]
    layers = [_layer(network, name, path) for name in hidden]
    heads = [name for name in _weights(network) if re.fullmatch(r"(mu|logits(\.\d+)?)\.weight", name)]
    if not heads:
        raise ConfigError(f"{path}: has neither 'a2c_network.mu' nor 'a2c_network.logits': it is no policy.")
    tops = [_layer(network, name, path) for name in heads]
    layers.append((torch.cat([weight for weight, _ in tops]), torch.cat([bias for _, bias in tops])))
    own = {name.rsplit(".", 1)[1]: v for name, v in state.items() if name.startswith("running_mean_std.")}
    mean, variance = _statistics(own, "running_mean", "running_var", tuple(layers), path)
    scale = torch.sqrt(variance + RL_GAMES_EPSILON) if own else variance
    return _checked(Checkpoint("rl_games", tuple(layers), mean, scale, _limit(own)), path)


def _tensors(content: Any, path: Path, key: str) -> State:
    """A state dictionary, if it is one: names, and plain tensors on the CPU."""
    if not isinstance(content, Mapping) or not all(
        isinstance(name, str)
        and isinstance(value, torch.Tensor)
        and value.layout is torch.strided
        and value.device.type == "cpu"
        and not value.is_quantized
        for name, value in content.items()
    ):
        raise ConfigError(f"{path}: '{key}' must hold a state dictionary of dense tensors.")
    for name, value in content.items():
        if value.numel() * value.element_size() > value.untyped_storage().nbytes():
            raise ConfigError(
                f"{path}: '{name}' is expanded to shape {list(value.shape)} from fewer numbers than that, which no "
                "weights are. Save it by `.contiguous()`, if it should be."
            )
    return content


def _check_feed_forward(state: State, path: Path) -> None:
    """Refuse what would be dropped without a word: memories, images, normalised layers."""
    for name, value in state.items():
        if re.search(r"(rnn|lstm|gru|cnn|conv)", name) or "weight_hh" in name or value.ndim > 2:
            raise ConfigError(
                f"{path}: '{name}' belongs to a recurrent or convolutional network; only feed-forward policies are "
                "imported from checkpoints. Export it as ONNX if it has no memory."
            )
        if name.endswith(".weight") and value.ndim == 1 and not _of_the_critic(name):
            raise ConfigError(
                f"{path}: '{name}' normalises a layer, which is not supported. Export it as ONNX."
            )


def _weights(state: State) -> list[str]:
    return [name for name, value in state.items() if name.endswith(".weight") and value.ndim == 2]


def _of_the_critic(name: str) -> bool:
    return re.search(r"(value|critic|sigma|log_std)", name) is not None


def _layer(state: State, name: str, path: Path) -> tuple[torch.Tensor, torch.Tensor]:
    weight, bias = state[name], state.get(name.removesuffix("weight") + "bias")
    if bias is None:
        bias = torch.zeros(weight.shape[0])
    if bias.shape != weight.shape[:1]:
        raise ConfigError(
            f"{path}: the bias beside '{name}' has shape {list(bias.shape)}, not {[weight.shape[0]]}."
        )
    return weight.float(), bias.float()


def _statistics(
    state: State, mean: str, variance: str, layers: tuple[tuple[torch.Tensor, torch.Tensor], ...], path: Path
) -> tuple[torch.Tensor, torch.Tensor]:
    """Running mean and variance; 0 and 1 where the learner did not normalise."""
    width = layers[0][0].shape[1] if layers else 0
    if not state:
        return torch.zeros(width), torch.ones(width)
    try:
        return state[mean].float(), state[variance].float()
    except (KeyError, TypeError, AttributeError) as error:
        raise ConfigError(
            f"{path}: the statistics of the observation lack '{mean}' or '{variance}'."
        ) from error


def _limit(statistics: State) -> float:
    return NORMALISED_LIMIT if statistics else math.inf


def _checked(checkpoint: Checkpoint, path: Path) -> Checkpoint:
    """Refuse layers that do not follow each other, and numbers that are none."""
    if not checkpoint.layers:
        raise ConfigError(f"{path}: the policy has no layers.")
    width = checkpoint.inputs
    for index, (weight, _) in enumerate(checkpoint.layers, start=1):
        if weight.shape[1] != width:
            raise ConfigError(
                f"{path}: layer {index} takes {weight.shape[1]} numbers, the one before it gives {width}: the policy "
                "is no plain sequence of layers. Export it as ONNX."
            )
        width = weight.shape[0]
    if checkpoint.mean.shape != (checkpoint.inputs,) or checkpoint.scale.shape != (checkpoint.inputs,):
        raise ConfigError(
            f"{path}: the statistics are of {list(checkpoint.mean.shape)} terms, the network takes {checkpoint.inputs}."
        )
    every = [*(tensor for layer in checkpoint.layers for tensor in layer), checkpoint.mean, checkpoint.scale]
    if not all(bool(torch.isfinite(tensor).all()) for tensor in every) or not bool(
        (checkpoint.scale > 0.0).all()
    ):
        raise ConfigError(f"{path}: holds numbers that are not finite, or a negative variance.")
    return checkpoint


ACTIVATIONS: dict[str, type[nn.Module]] = {
    "elu": nn.ELU,
    "relu": nn.ReLU,
    "tanh": nn.Tanh,
    "selu": nn.SELU,
    "sigmoid": nn.Sigmoid,
    "leaky_relu": nn.LeakyReLU,
    "softplus": nn.Softplus,
}
OPERATORS: dict[type[nn.Module], tuple[str, dict[str, float]]] = {  # of ONNX, with PyTorch's constants
    nn.ELU: ("Elu", {"alpha": 1.0}),
    nn.ReLU: ("Relu", {}),
    nn.Tanh: ("Tanh", {}),
    nn.SELU: ("Selu", {"alpha": 1.6732632423543772, "gamma": 1.0507009873554805}),
    nn.Sigmoid: ("Sigmoid", {}),
    nn.LeakyReLU: ("LeakyRelu", {"alpha": 0.01}),
    nn.Softplus: ("Softplus", {}),
}
OUTPUTS = ("none", "tanh")


@dataclass(frozen=True)
class Activations:
    """What a checkpoint does not hold."""

    hidden: str  # of ACTIVATIONS
    output: str  # of OUTPUTS


def find_activations(checkpoint: Path, hidden: str | None, output: str | None) -> Activations:
    """Take the activations from the command line, else from the `agent.yaml` of the run.

    Args:
        checkpoint: The file of the weights; `params/agent.yaml` is looked for beside it and up to two folders above.
        hidden: As given by the user.
        output: As given by the user; "none" by default.

    Raises:
        ConfigError: A name is unknown, or nothing says what the hidden activation is.
    """
    config = _agent_config(checkpoint) if hidden is None or output is None else None
    found = _activations_in(*config) if config else None
    hidden = hidden or (found.hidden if found else None)
    if hidden is None:
        raise ConfigError(
            f"{checkpoint}: weights alone do not say which activation lies between the layers, and there is no "
            f"params/agent.yaml beside them. Give --activation, one of {', '.join(ACTIVATIONS)}."
        )
    if hidden not in ACTIVATIONS:
        raise ConfigError(
            f"activation '{hidden}' is unknown; it must be one of {', '.join(ACTIVATIONS)}."
            f"{did_you_mean(hidden, ACTIVATIONS)}"
        )
    output = output or (found.output if found else "none")
    if output not in OUTPUTS:
        raise ConfigError(
            f"output activation '{output}' is unknown; it must be one of {', '.join(OUTPUTS)}."
            f"{did_you_mean(output, OUTPUTS)}"
        )
    return Activations(hidden, output)


def _agent_config(checkpoint: Path) -> tuple[Path, Any] | None:
    for folder in checkpoint.absolute().parents[:3]:
        for path in (folder / "params" / "agent.yaml", folder / "agent.yaml"):
            if path.is_file():
                try:
                    return path, yaml_text.load(read_bounded(path, CONFIG_BYTES).decode())
                except (yaml_text.YamlError, UnicodeDecodeError, OSError) as error:
                    raise ConfigError(
                        f"{path}: cannot be read as YAML: {str(error).splitlines()[0]}. "
                        "Give --activation and --output-activation instead."
                    ) from error
    return None


def _activations_in(path: Path, config: Any) -> Activations:
    """Those of a configuration of skrl (`models`) or of rl_games (`params`)."""
    try:
        if "models" in config:
            policy = config["models"]["policy"]
            hidden = policy["network"][0]["activations"]
            squashed = str(policy.get("output", "")).replace(" ", "").lower().startswith("tanh(")
            hidden = hidden if isinstance(hidden, str) else _only(hidden)
            return Activations(hidden.lower(), "tanh" if squashed else "none")
        network = config["params"]["network"]
        squash = network.get("space", {}).get("continuous", {}).get("mu_activation")
        output = "none" if squash is None else str(squash).lower()
        return Activations(str(network["mlp"]["activation"]).lower(), output)
    except (KeyError, TypeError, IndexError, AttributeError, ValueError) as error:
        raise ConfigError(
            f"{path}: names no activation where skrl and rl_games write it ({type(error).__name__}: {error}). "
            "Give --activation and --output-activation instead."
        ) from error


def _only(names: list[str]) -> str:
    if len(set(names)) != 1:
        raise ValueError(f"activations {names} differ from layer to layer, which is not supported")
    return str(names[0])
