"""A row of the node table: what is known of a node, whatever the plan, and how a plan makes processes of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from fulmar_bringup.emulation import Emulation
from fulmar_bringup.node_spec import PLANT, NodeSpec, Parameter, node_spec
from fulmar_bringup.run_plan import RunPlan


@dataclass(frozen=True)
class Launcher:
    """What only the process knows that starts the nodes of a plan."""

    record: Mapping[str, str] | None = None  # arguments of `recorder_spec`; None: nothing is recorded
    emulation: Emulation | None = None  # of the device, where the plan has one emulated
    port: str = ""  # of a device, in the place of what the hardware file says


def _anew(_said: Mapping[str, str]) -> dict[str, Parameter]:
    return {}


@dataclass(frozen=True)
class NodeRow:
    """What is known of a node, whatever the plan."""

    specs: Callable[[RunPlan, Launcher], Iterable[NodeSpec]]  # its processes; none where a plan needs none
    names: tuple[str, ...]  # of the node in ROS
    reports: bool = True  # publishes diagnostics
    shown: bool = True  # by `fulmar status`, where it runs
    part: str = PLANT  # of a system in two places: beside the plant or the controller
    beats: bool = False  # a helper that reports whatever the robot does: silent for long, it hangs
    indispensable: bool = False  # a helper without which the robot ends, where it does not come back
    resume: Callable[[Mapping[str, str]], dict[str, Parameter]] = _anew  # parameters, from its last status


def robot_spec(
    plan: RunPlan, name: str, module: str, parameters: Mapping[str, Parameter], **more: Any
) -> NodeSpec:
    """The process of a Python module for a plan's robot, with its topics renamed; `more` as in `NodeSpec`."""
    return node_spec(plan.namespace, name, module, parameters, remappings=dict(plan.remappings), **more)
