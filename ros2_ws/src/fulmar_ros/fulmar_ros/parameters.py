"""Parameters of a node as a frozen dataclass, declared and checked in one call; name and frames of its robot."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import TypeVar

from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from fulmar_core.config.errors import ConfigError, did_you_mean
from fulmar_core.robots.robot import Robot
from fulmar_core.wires.robot_name import Frames, frames_of

T = TypeVar("T")
QOS_OVERRIDES = "qos_overrides."  # rclpy declares these with the publisher or subscription that they are for


def read_parameters(node: Node, cls: type[T]) -> T:
    """Declare one parameter for each field of a dataclass and read them all.

    All fields have defaults; `__post_init__` may raise ValueError.

    Raises:
        ConfigError: A parameter has another type than its default or is not known, or the dataclass refuses it.
    """
    assert dataclasses.is_dataclass(cls)
    values = {}
    for field in dataclasses.fields(cls):
        default = list(field.default) if isinstance(field.default, tuple) else field.default
        try:
            node.declare_parameter(field.name, default)
            value = node.get_parameter(field.name).value
        except ParameterException as error:
            value = _as_number(node, field.name, default, error)
        values[field.name] = tuple(value) if isinstance(field.default, tuple) else value
    _refuse_unknown(node, values)
    try:
        return cls(**values)
    except ValueError as error:
        raise ConfigError(f"parameters of node '{node.get_name()}': {error}") from error


def _refuse_unknown(node: Node, known: Iterable[str]) -> None:
    """Refuse parameters that the node does not have: a misspelt one would change nothing.

    Those for all nodes count, those for other nodes do not, nor do rclpy's own, such as `use_sim_time`.
    """
    for name in node._parameter_overrides:
        if name not in known and not node.has_parameter(name) and not name.startswith(QOS_OVERRIDES):
            raise ConfigError(
                f"parameter '{name}' of node '{node.get_name()}' is not known.{did_you_mean(name, known)} In a file "
                "for several nodes, write it below the name of the node that has it."
            )


def _as_number(node: Node, name: str, default: object, error: Exception) -> float:
    """A whole number where a fraction is expected, which `-p rate:=2` sends."""
    given = node._parameter_overrides.get(name)
    if isinstance(default, float) and isinstance(given, Parameter) and isinstance(given.value, int):
        node.declare_parameter(name, default, ignore_override=True)
        return float(given.value)
    raise ConfigError(f"parameter '{name}' of node '{node.get_name()}': {error}") from error


def name_of(node: Node, robot: Robot) -> str:
    """Name of a node's robot: its namespace; without one, the robot's type."""
    return node.get_namespace().strip("/") or robot.name


def own_frames(node: Node, robot: Robot) -> Frames:
    """Frames of a node's robot."""
    return frames_of(name_of(node, robot), robot.name)
