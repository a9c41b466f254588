"""Rows of the nodes that a system file names beside those that every system has."""

from __future__ import annotations

from fulmar_bringup.node_row import NodeRow
from fulmar_bringup.node_spec import NodeSpec, node_spec
from fulmar_bringup.system import System
from fulmar_core.wires.robot_name import namespace_of


def own_nodes(system: System) -> tuple[NodeSpec, ...]:
    """The processes of a system's own nodes."""
    space = namespace_of(system.name or system.robot)
    return tuple(
        node_spec(
            space,
            node.name,
            node.module,
            node.parameters,
            inputs=node.inputs,
            outputs=node.outputs,
            loss=node.loss,
        )
        for node in system.nodes
    )


ROW = NodeRow(lambda plan, _: plan.nodes, (), shown=False)
