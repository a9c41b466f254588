"""Row of the node that serves ROS's standard services for simulators."""

from __future__ import annotations

from fulmar_bringup.node_row import Launcher, NodeRow, robot_spec
from fulmar_bringup.node_spec import RESTARTS, NodeSpec, given
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.robots.jsbsim_models import is_jsbsim
from fulmar_core.robots.topics import SIMULATION_EVENT, SIMULATION_STATE, TRUTH

NAME = "simulation_interfaces"


def _specs(plan: RunPlan, _launcher: Launcher) -> tuple[NodeSpec, ...]:
    if NAME not in plan.extras:
        return ()
    parameters = given(robot=plan.robot, task=plan.task, thing=plan.thing, control_hz=plan.control_hz)
    if is_jsbsim(plan.backend):
        parameters["places"] = False
    row = robot_spec(
        plan,
        NAME,
        "fulmar_ros.simulation_interfaces_node",
        parameters,
        observed=(TRUTH.name, SIMULATION_EVENT.name),
        outputs=(SIMULATION_STATE.name,),
        optional=True,
        loss=RESTARTS,
    )
    return (row,)


ROW = NodeRow(_specs, (NAME,), beats=True)
