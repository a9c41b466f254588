"""One process with one node, as a launcher starts it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

Parameter = bool | int | float | str | list[float] | list[int] | list[str]
PLANT, CONTROLLER = PARTS = (
    "plant",
    "controller",
)  # of a system, each of which may run in a place of its own
RESTARTS = "restarts"  # the loss of a node takes no robot's control away: it is started again, and reported
ENDS = "ends"  # the robot ends: its refuge comes first, then every process is stopped
LOSSES = (RESTARTS, ENDS)


@dataclass(frozen=True)
class NodeSpec:
    """One process with one node."""

    name: str  # of the node
    package: str  # ament package
    executable: str  # script that the package installs
    module: str  # the same as a Python module
    namespace: str
    parameters: dict[str, Parameter] = field(default_factory=dict)
    quiet: bool = False  # prints only warnings and errors
    remappings: dict[str, str] = field(default_factory=dict)  # topics under other names
    network: str = ""  # namespace of Linux that it runs in; empty: ours
    inputs: tuple[str, ...] = ()  # topics without which it is of no use
    outputs: tuple[str, ...] = ()  # topics that it publishes
    observed: tuple[str, ...] = ()  # topics that it receives if they are there
    optional: bool = False  # no node waits for it
    loss: str = ENDS  # what its loss means: one of `LOSSES`
    ends_within_s: float = 0.0  # that an orderly end may take; 0: as any node's [s]
    patience_s: float = 4.0  # from the request to end until it is killed [s]


def node_spec(
    namespace: str, name: str, module: str, parameters: Mapping[str, Parameter], **more: Any
) -> NodeSpec:
    """That of a Python module: its first part is the package, its last part the executable."""
    package, executable = module.partition(".")[0], module.rpartition(".")[2]
    return NodeSpec(name, package, executable, module, namespace, dict(parameters), **more)


def given(**values: Parameter | None) -> dict[str, Parameter]:
    """The parameters that say something: none is false, 0 or empty, which is what nodes have by default."""
    return {name: value for name, value in values.items() if value}
