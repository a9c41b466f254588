"""Row of the nodes that estimate, and the simulated cameras that they need."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fulmar_bringup.node_row import NodeRow, robot_spec
from fulmar_bringup.node_spec import NodeSpec, Parameter
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.estimators.kinds import KINDS, estimator_kind
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ANSWER, EVENTS, EVENTS_2, PERIOD, TRUTH, Wire
from fulmar_core.worlds.scenario import load_scenario


def simulates_without_noise(plan: RunPlan) -> bool:
    """Whether what the sensors of a plan measure is exact, so that it repeats itself while the robot stands."""
    if plan.backend == "hardware":
        return False
    return plan.backend == "mock" or not load_scenario(plan.scenario).sensor_noise


def camera_specs(plan: RunPlan) -> tuple[NodeSpec, ...]:
    """The node that simulates the event cameras of a robot, where an estimator takes their events."""
    files = plan.guards.files
    if plan.backend == "hardware" or not any(EVENTS in estimator_kind(file).takes.values() for file in files):
        return ()
    outputs = (EVENTS, EVENTS_2)[: len(load_robot(plan.robot).event_cameras)]
    parameters: dict[str, Parameter] = {"robot": plan.robot, "seed": plan.seed}
    return (
        chain_spec(
            plan, "event_camera", "sim_nodes.event_camera_node", parameters, (TRUTH,), (), outputs, ()
        ),
    )


def estimator_specs(plan: RunPlan) -> tuple[NodeSpec, ...]:
    """The nodes that estimate, each after those whose outputs are its inputs."""
    rows = list(camera_specs(plan))
    cameras = len(rows)
    for file in plan.guards.files:
        rows.append(_estimator_spec(plan, file, (*plan.nodes, *rows)))
    return tuple(rows[cameras:])


def _estimator_spec(plan: RunPlan, file: str, others: Sequence[NodeSpec]) -> NodeSpec:
    """The node that estimates, by a file of `configs/estimators`."""
    kind = estimator_kind(file, load_robot(plan.robot))
    parameters: dict[str, Parameter] = {"robot": plan.robot, "estimator": file}
    if simulates_without_noise(plan):
        parameters["exact_sensors"] = True
    inputs, observed = tuple(kind.takes.values()), tuple(kind.takes_if_there.values())
    outputs = (*kind.publishes, *((kind.status,) if kind.status else ()))
    module = "fulmar_ros.estimator_node"
    return chain_spec(plan, kind.node, module, parameters, inputs, observed, outputs, others)


def chain_spec(
    plan: RunPlan,
    name: str,
    module: str,
    parameters: dict[str, Parameter],
    takes: Sequence[Wire],
    sees: Sequence[Wire],
    publishes: Sequence[Wire],
    others: Sequence[NodeSpec],
    **more: Any,
) -> NodeSpec:
    """A row that takes part in lock step, after those of the others whose outputs it takes; `more` as in `NodeSpec`."""
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
    return robot_spec(
        plan, name, module, parameters, inputs=inputs, observed=observed, outputs=outputs, **more
    )


NAMES = tuple(dict.fromkeys(kind.node for kind in KINDS.values()))
ROW = NodeRow(lambda plan, _: estimator_specs(plan), NAMES)
