"""Activations of a policy of another learner, from the `agent.yaml` that Isaac Lab leaves in the run folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from torch import nn

from fulmar_core.errors import ConfigError, did_you_mean

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
                    return path, yaml.safe_load(path.read_text(encoding="utf-8"))
                except (yaml.YAMLError, UnicodeDecodeError) as error:
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
