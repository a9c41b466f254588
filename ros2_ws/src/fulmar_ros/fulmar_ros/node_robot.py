"""What the robot of a node is called, by the namespace of the node; and which robots are heard."""

from __future__ import annotations

from rclpy.node import Node

from fulmar_core.robot import Robot
from fulmar_core.robot_name import Frames, frames_of

ROBOT_NODES = {"plant", "controller"}


def name_of(node: Node, robot: Robot) -> str:
    """Name of a node's robot: its namespace; without one, the robot's type."""
    return node.get_namespace().strip("/") or robot.name


def own_frames(node: Node, robot: Robot) -> Frames:
    """Frames of a node's robot."""
    return frames_of(name_of(node, robot), robot.name)


def heard_spaces(node: Node) -> set[str]:
    """Namespaces with a plant or a controller, as far as they are discovered."""
    return {space for name, space in node.get_node_names_and_namespaces() if name in ROBOT_NODES}


def heard_words(node: Node) -> str:
    """A sentence that lists the robots that are heard."""
    names = ", ".join(sorted(space.strip("/") for space in heard_spaces(node) - {"/"}))
    return f"Robots that are heard: {names or 'none'}."
