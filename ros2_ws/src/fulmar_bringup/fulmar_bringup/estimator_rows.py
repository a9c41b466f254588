"""Rows of the nodes that estimate, and of the simulated cameras that they need."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fulmar_bringup.run_plan import NodeSpec, Parameter, RunPlan, node_row
from fulmar_core.estimators.kinds import estimator_kind
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ANSWER, EVENTS, EVENTS_2, PERIOD, TRUTH, Wire
from fulmar_core.worlds.scenario import load_scenario

CAMERA = "event_camera"  # name of the node


def robot_row(
    plan: RunPlan, name: str, module: str, parameters: Mapping[str, Parameter], **more: Any
) -> NodeSpec:
    """A row of a plan's robot, with its topics renamed; `more` as of `NodeSpec`."""
    return node_row(plan.namespace, name, module, parameters, remappings=dict(plan.remappings), **more)


def simulates_without_noise(plan: RunPlan) -> bool:
    """Whether what the sensors of a plan measure is exact, so that it repeats itself while the robot stands."""
    if plan.backend == "hardware":
        return False
    return plan.backend == "mock" or not load_scenario(plan.scenario).sensor_noise


def estimator_specs(plan: RunPlan) -> tuple[NodeSpec, ...]:
    """Nodes between plant and controller that Fulmar brings, each after those whose outputs are its inputs."""
    guards, rows = plan.guards, list[NodeSpec]()
    files = (*guards.estimators, *((guards.estimator,) if guards.estimator else ()))
    simulated = plan.backend != "hardware"
    if simulated and any(EVENTS in estimator_kind(file).takes.values() for file in files):
        rows.append(_camera_spec(plan))
    for file in files:
        rows.append(_estimator_spec(plan, file, (*plan.nodes, *rows)))
    return tuple(rows)


def _camera_spec(plan: RunPlan) -> NodeSpec:
    """The node that simulates the event cameras of a robot."""
    count = len(load_robot(plan.robot).event_cameras)
    outputs = (EVENTS, EVENTS_2)[:count]
    parameters: dict[str, Parameter] = {"robot": plan.robot, "seed": plan.seed}
    return _row(plan, CAMERA, "sim_nodes.event_camera_node", parameters, (TRUTH,), (), outputs, ())


def _estimator_spec(plan: RunPlan, file: str, others: Sequence[NodeSpec]) -> NodeSpec:
    """The node that estimates, by a file of `configs/estimators`."""
    kind = estimator_kind(file, load_robot(plan.robot))
    parameters: dict[str, Parameter] = {"robot": plan.robot, "estimator": file}
    if simulates_without_noise(plan):
        parameters["exact_sensors"] = True
    inputs, observed = tuple(kind.takes.values()), tuple(kind.takes_if_there.values())
    outputs = (*kind.publishes, *((kind.status,) if kind.status else ()))
    module = "fulmar_ros.estimator_node"
    return _row(plan, kind.node, module, parameters, inputs, observed, outputs, others)


def _row(
    plan: RunPlan,
    name: str,
    module: str,
    parameters: dict[str, Parameter],
    takes: Sequence[Wire],
    sees: Sequence[Wire],
    publishes: Sequence[Wire],
    others: Sequence[NodeSpec],
) -> NodeSpec:
    """A row that takes part in lock step, after those of the others whose outputs it takes."""
    inputs, observed, outputs = (tuple(wire.name for wire in wires) for wires in (takes, sees, publishes))
    if plan.lockstep:
        parameters["lockstep"] = True
        upstream = [
            node.name
            for node in others
            if PERIOD.name in node.inputs and {*node.outputs} & {*inputs, *observed}
        ]
        if upstream:
            parameters["upstream"] = upstream
        inputs, outputs = (*inputs, PERIOD.name), (*outputs, ANSWER.name)
    return robot_row(plan, name, module, parameters, inputs=inputs, observed=observed, outputs=outputs)
