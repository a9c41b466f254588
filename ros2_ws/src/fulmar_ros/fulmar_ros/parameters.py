"""ROS parameters as a frozen dataclass: declared, typed and checked in one call."""

from __future__ import annotations

import dataclasses
from typing import TypeVar

from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from fulmar_core.errors import ConfigError

T = TypeVar("T")


def read_parameters(node: Node, cls: type[T]) -> T:
    """Declare one parameter for each field and read them all.

    Args:
        node: Whose parameters.
        cls: Dataclass whose fields all have defaults; its `__post_init__` may raise ValueError.

    Returns:
        The filled dataclass.

    Raises:
        ConfigError: A parameter has another type than its default, or the dataclass refuses it.
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
    try:
        return cls(**values)
    except ValueError as error:
        raise ConfigError(f"parameters of node '{node.get_name()}': {error}") from error


def _as_number(node: Node, name: str, default: object, error: Exception) -> float:
    """A whole number where a fraction is expected, which `-p rate:=2` sends."""
    given = node._parameter_overrides.get(name)
    if isinstance(default, float) and isinstance(given, Parameter) and isinstance(given.value, int):
        node.declare_parameter(name, default, ignore_override=True)
        return float(given.value)
    raise ConfigError(f"parameter '{name}' of node '{node.get_name()}': {error}") from error
