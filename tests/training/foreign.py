"""Policies as other stacks save them, with seeded random weights."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper
from torch import nn

ACTIVATIONS = {"elu": nn.ELU, "relu": nn.ReLU, "tanh": nn.Tanh}


def network(
    inputs: int, outputs: int, *, hidden=(16, 12), activation="elu", tanh_output=False
) -> nn.Sequential:
    """Build the policy network that the checkpoint is of."""
    torch.manual_seed(5)
    sizes = (inputs, *hidden)
    layers: list[nn.Module] = []
    for before, after in zip(sizes, hidden, strict=False):
        layers += [nn.Linear(before, after), ACTIVATIONS[activation]()]
    layers += [nn.Linear(sizes[-1], outputs), *([nn.Tanh()] if tanh_output else [])]
    return nn.Sequential(*layers).eval()


def statistics(inputs: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Running mean and variance of an observation, in double precision as both learners keep them."""
    rng = np.random.default_rng(7)
    return torch.tensor(rng.normal(0.0, 0.3, inputs)), torch.tensor(rng.uniform(0.2, 2.0, inputs))


def save_skrl(path: Path, net: nn.Sequential, *, shared: bool = False) -> Path:
    """Save what skrl's `agent.save` does."""
    linear = [(name, value) for name, value in net.state_dict().items()]
    last = linear[-1][0].split(".")[0]
    policy = {}
    for name, value in linear:
        index, kind = name.split(".")
        policy[f"policy_layer.{kind}" if index == last else f"net_container.{name}"] = value
    policy["log_std_parameter"] = torch.zeros(2)
    if shared:
        policy |= {"value_layer.weight": torch.zeros(1, 12), "value_layer.bias": torch.zeros(1)}
    mean, variance = statistics(net[0].in_features)
    scaler = {"running_mean": mean, "running_variance": variance, "current_count": torch.tensor(9.0)}
    value = {"net_container.0.weight": torch.zeros(3, net[0].in_features)}
    torch.save(
        {"policy": policy, "value": value, "optimizer": {"state": {}}, "state_preprocessor": scaler}, path
    )
    return path


def save_rl_games(path: Path, net: nn.Sequential, *, valves: int = 0) -> Path:
    """Save what rl_games does: with separate heads for the valves, and the mean reward as a scalar of NumPy."""
    model = {}
    *hidden, top = [layer for layer in net if isinstance(layer, nn.Linear)]
    for index, layer in enumerate(hidden):
        model[f"a2c_network.actor_mlp.{2 * index}.weight"] = layer.weight.detach()
        model[f"a2c_network.actor_mlp.{2 * index}.bias"] = layer.bias.detach()
        model[f"a2c_network.critic_mlp.{2 * index}.weight"] = torch.zeros(4, 4)
    if valves:
        for index in range(valves):
            rows = slice(2 * index, 2 * index + 2)
            model[f"a2c_network.logits.{index}.weight"] = top.weight.detach()[rows].clone()
            model[f"a2c_network.logits.{index}.bias"] = top.bias.detach()[rows].clone()
    else:
        model |= {"a2c_network.mu.weight": top.weight.detach(), "a2c_network.mu.bias": top.bias.detach()}
        model["a2c_network.sigma"] = torch.zeros(2)
    model |= {"a2c_network.value.weight": torch.zeros(1, 12), "a2c_network.value.bias": torch.zeros(1)}
    mean, variance = statistics(net[0].in_features)
    model |= {"running_mean_std.running_mean": mean, "running_mean_std.running_var": variance}
    model["value_mean_std.running_mean"] = torch.zeros(1, dtype=torch.float64)
    torch.save(
        {"model": model, "epoch": 3, "frame": 9, "last_mean_rewards": np.float32(1.5), "env_state": None},
        path,
    )
    return path


def export_onnx(path: Path, net: nn.Sequential) -> Path:
    """Export a network as users of Isaac Lab do: input `obs`, one row, further outputs behind the actions."""

    class Exported(nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.net = net

        def forward(self, obs):
            mean = self.net(obs)
            return mean, torch.zeros_like(mean)

    torch.onnx.export(
        Exported().eval(),
        (torch.zeros(1, net[0].in_features),),
        str(path),
        input_names=["obs"],
        output_names=["mu", "log_std"],
        dynamo=True,
        verbose=False,
        external_data=False,
    )
    return path


def write_onnx(path: Path, net: nn.Sequential, *, opset: int = 11) -> Path:
    """Write a network of linear layers and ELU as an old exporter does."""
    nodes, weights, name = [], [], "obs"
    for index, layer in enumerate(net):
        after = f"after_{index}"
        if isinstance(layer, nn.Linear):
            weights += [
                numpy_helper.from_array(value.detach().numpy(), f"{index}.{kind}")
                for kind, value in layer.named_parameters()
            ]
            nodes.append(
                helper.make_node("Gemm", [name, f"{index}.weight", f"{index}.bias"], [after], transB=1)
            )
        else:
            nodes.append(helper.make_node("Elu", [name], [after]))
        name = after
    ends = [
        helper.make_tensor_value_info(each, TensorProto.FLOAT, [1, width])
        for each, width in (("obs", net[0].in_features), (name, net[-1].out_features))
    ]
    graph = helper.make_graph(nodes, "policy", ends[:1], ends[1:], weights)
    onnx.save_model(
        helper.make_model(graph, opset_imports=[helper.make_opsetid("", opset)], ir_version=6), path
    )
    return path


def normalised(seen: np.ndarray, learner: str) -> torch.Tensor:
    """The observation after the running statistics, as each learner applies them."""
    mean, variance = statistics(seen.shape[-1])
    x = torch.tensor(seen, dtype=torch.float32)
    if learner == "onnx":
        return x
    if learner == "skrl":
        scaled = (x - mean.float()) / (torch.sqrt(variance.float()) + 1e-8)
    else:
        scaled = (x - mean.float()) / torch.sqrt(variance.float() + 1e-5)
    return torch.clamp(scaled, -5.0, 5.0)
