"""Row of the node that a person drives with; it starts beside a system that runs, and no system has it by itself."""

from __future__ import annotations

from fulmar_bringup.node_spec import NodeSpec, Parameter, node_spec
from fulmar_core.robots.topics import JOY, TELEOP
from fulmar_core.wires.robot_name import namespace_of


def teleop_spec(robot: str, *, name: str = "", keyboard: bool = True, share: float = 0.5) -> NodeSpec:
    """The node that a person drives with; it starts beside a system that runs, and no system has it by itself.

    Args:
        robot: Type of the robot.
        name: What the robot is called; its type by default.
        keyboard: Whether keys drive, or only joysticks.
        share: Of full command.
    """
    parameters: dict[str, Parameter] = {"robot": robot, "keyboard": keyboard, "share": share}
    wires = {"outputs": (TELEOP.name,), "observed": (JOY.name,)}
    return node_spec(namespace_of(name or robot), "teleop", "fulmar_ros.teleop_node", parameters, **wires)
