"""Row of the node that serves Nav2's actions."""

from __future__ import annotations

from fulmar_bringup.node_row import Launcher, NodeRow, robot_spec
from fulmar_bringup.node_spec import RESTARTS, NodeSpec, given
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.robots.topics import GOAL_WIRES, ODOMETRY, ORIGIN, STATUS
from fulmar_core.safety.geofence import NO_AREA
from fulmar_core.tasks import load_task


def _specs(plan: RunPlan, _launcher: Launcher) -> tuple[NodeSpec, ...]:
    if "actions" not in plan.extras:
        return ()
    task, area = load_task(plan.task, plan.thing), plan.guards.area
    parameters = given(
        robot=plan.robot,
        task=plan.task,
        thing=plan.thing,
        area=list(area) if area != NO_AREA else None,
        unmapped=plan.is_real and not plan.origin,
    )
    row = robot_spec(
        plan,
        "actions",
        "fulmar_ros.action_node",
        parameters,
        observed=(ODOMETRY.name, ORIGIN.name, STATUS.name),
        outputs=(GOAL_WIRES[task.goal_topic].name,),
        optional=True,
        loss=RESTARTS,
    )
    return (row,)


ROW = NodeRow(_specs, ("actions",), beats=True)
