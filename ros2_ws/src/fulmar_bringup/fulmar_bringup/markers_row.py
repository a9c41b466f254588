"""Row of the node that draws for viewers; nothing depends on it."""

from __future__ import annotations

from fulmar_bringup.node_row import Launcher, NodeRow, robot_spec
from fulmar_bringup.node_spec import RESTARTS, NodeSpec, given
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.robots.topics import ACTUATORS_STATE, DIAGNOSTICS, MARKERS, OBSTACLES, STATUS, goal_wires
from fulmar_core.safety.geofence import NO_AREA
from fulmar_core.tasks import load_task


def _specs(plan: RunPlan, _launcher: Launcher) -> tuple[NodeSpec, ...]:
    if "markers" not in plan.extras:
        return ()
    task, area = load_task(plan.task, plan.thing), plan.guards.area
    parameters = given(
        robot=plan.robot, task=plan.task, thing=plan.thing, area=list(area) if area != NO_AREA else None
    )
    goals = (wire.name for wire in goal_wires(task.goal_topic))
    row = robot_spec(
        plan,
        "markers",
        "fulmar_ros.markers_node",
        parameters,
        observed=(*goals, OBSTACLES.name, ACTUATORS_STATE.name, STATUS.name, DIAGNOSTICS.name),
        outputs=(MARKERS.name,),
        optional=True,
        loss=RESTARTS,
    )
    return (row,)


ROW = NodeRow(_specs, ("markers",), beats=True)
