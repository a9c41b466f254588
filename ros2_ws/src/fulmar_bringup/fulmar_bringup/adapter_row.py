"""Row of the node that passes the commands of another stack on to the plant."""

from __future__ import annotations

from fulmar_bringup.node_row import Launcher, NodeRow, robot_spec
from fulmar_bringup.node_spec import CONTROLLER, NodeSpec, given
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import command_wire


def _specs(plan: RunPlan, _launcher: Launcher) -> tuple[NodeSpec, ...]:
    if not plan.adapter:
        return ()
    parameters = given(hardware=plan.adapter, topic=plan.adapter_topic)
    commands = (command_wire(load_robot(plan.robot)).name,)
    return (robot_spec(plan, "adapter", "hardware_drivers.adapter_node", parameters, outputs=commands),)


ROW = NodeRow(_specs, ("adapter",), shown=False, part=CONTROLLER)
