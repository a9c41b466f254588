"""Row of the node that broadcasts observation and action."""

from __future__ import annotations

from fulmar_bringup.node_row import Launcher, NodeRow, robot_spec
from fulmar_bringup.node_spec import CONTROLLER, RESTARTS, NodeSpec, given
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.robots.topics import ACTION, BROADCAST_NAMES, BROADCAST_VALUES, OBSERVATION


def _specs(plan: RunPlan, _launcher: Launcher) -> tuple[NodeSpec, ...]:
    if "broadcast" not in plan.extras:
        return ()
    row = robot_spec(
        plan,
        "broadcast",
        "fulmar_ros.broadcast_node",
        given(robot=plan.robot),
        observed=(OBSERVATION.name, ACTION.name),
        outputs=(BROADCAST_NAMES.name, BROADCAST_VALUES.name),
        optional=True,
        loss=RESTARTS,
    )
    return (row,)


ROW = NodeRow(_specs, ("broadcast",), part=CONTROLLER, beats=True)
