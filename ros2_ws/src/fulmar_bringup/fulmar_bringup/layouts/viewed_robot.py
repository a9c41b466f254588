"""A robot as viewers find it: its type, its name, and the names of its topics, services and frames."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot, load_robot_file
from fulmar_core.robots.topics import COMMAND, VELOCITY_COMMAND, Wire, command_wire
from fulmar_core.wires.robot_name import Frames, checked_name, frames_of, namespace_of


@dataclass(frozen=True)
class ViewedRobot:
    """A robot and what it is called."""

    robot: Robot
    name: str

    @property
    def frames(self) -> Frames:
        """Names of its frames."""
        return frames_of(self.name, self.robot.name)

    @property
    def in_space(self) -> bool:
        """Whether it moves in space and not in the plane."""
        return self.robot.state_type.AXES == 3

    def topic(self, wire: Wire) -> str:
        """Full name of a wire's topic."""
        return wire.name if wire.name.startswith("/") else self.service(wire.name)

    def service(self, name: str) -> str:
        """Full name of a service."""
        return f"{namespace_of(self.name)}/{name}"

    def commands(self) -> dict[str, str]:
        """Where each number of a command is, as a path into messages, by its name."""
        wire, names = command_wire(self.robot), self.robot.actuators.names
        if wire is VELOCITY_COMMAND:
            fields = ["twist.linear.x", "twist.angular.z"]
        else:
            assert wire is COMMAND
            fields = list(f"effort[{number}]" for number in range(len(names)))
        return {name: f"{self.topic(wire)}.{field}" for name, field in zip(names, fields, strict=True)}


def viewed_robot(robot: str, name: str | None = None) -> ViewedRobot:
    """Load a robot for its layout.

    Args:
        robot: A name from `fulmar list robots`, or a robot's file that ends in .yaml or .yml.
        name: What it is called; as its type by default.

    Raises:
        ConfigError: There is none of that name, the file cannot be read, or ROS cannot take the name.
    """
    path = Path(robot)
    found = load_robot_file(path) if path.suffix in (".yaml", ".yml") else load_robot(robot)
    return ViewedRobot(found, checked_name(found.name if name is None else name))
