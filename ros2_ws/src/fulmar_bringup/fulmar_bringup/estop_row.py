"""Row of the node that is an e-stop."""

from __future__ import annotations

from fulmar_bringup.node_row import Launcher, NodeRow, robot_spec
from fulmar_bringup.node_spec import NodeSpec, given
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.robots.topics import ESTOP


def _specs(plan: RunPlan, _launcher: Launcher) -> tuple[NodeSpec, ...]:
    if not plan.guards.estop:
        return ()
    parameters = given(robot=plan.robot, pressed=plan.unattended)
    row = robot_spec(
        plan, "estop", "fulmar_ros.estop_node", parameters, outputs=(ESTOP.name,), loss=plan.loss_of_helpers
    )
    return (row,)


ROW = NodeRow(_specs, ("estop",), beats=True, indispensable=True)
