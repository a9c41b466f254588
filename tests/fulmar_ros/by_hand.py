"""A node that nobody serves: a test calls what its subscriptions and its beat would, and keeps what it publishes."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import rclpy
from rclpy.signals import SignalHandlerOptions

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks.goal import goal_at
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.convert import OdometryWriter, VectorWriter
from fulmar_ros.goal_messages import goal_message
from fulmar_ros.plant_node import PlantNode
from tests.states import planar_state

PLATFORM = load_robot("floating_platform")
FAR = goal_at((4.0, 0.0, 0.0))
STEP_NS = 100_000_000
JUST_NOW = {"source_timestamp": 1, "publication_sequence_number": 1, "received_timestamp": 1}


@contextmanager
def ros() -> Iterator[None]:
    """A context of rclpy, which ends with its nodes."""
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        yield
    finally:
        rclpy.try_shutdown()


def arguments(*parameters: str) -> list[str]:
    """Of a node of the platform, with parameters such as `lockstep:=true`."""
    return [
        "--ros-args",
        "-r",
        "__ns:=/floating_platform",
        *(word for parameter in parameters for word in ("-p", parameter)),
    ]


class DrivenController:
    """A controller in lock step, which answers each odometry at once."""

    def __init__(self, make: Callable, *parameters: str) -> None:
        self.codes: list[int] = []
        self.node = ControllerNode(make, self.codes.append, cli_args=arguments("lockstep:=true", *parameters))
        self.sent: list[np.ndarray] = []
        self._times = itertools.count(STEP_NS, STEP_NS)
        self._write = OdometryWriter(PLATFORM.sensors.odometry)
        wires = self.node.wires
        wires.publish_command = lambda command, _stamp: self.sent.append(np.array(command))
        wires.publish_safe = lambda _stamp: self.sent.append(PLATFORM.actuators.safe_command)
        self.node.guard.take_bearing(True)

    def give(self) -> None:
        """A goal far away."""
        self.node._on_goal(goal_message(FAR, "goal_pose", 7), JUST_NOW)

    def see(self, data: bytes | None = None) -> np.ndarray | None:
        """Receive odometry of a robot that stands, or these bytes; the command that answered it, if one did."""
        before, stamp = len(self.sent), next(self._times)
        self.node._on_odometry(
            self._write.raw(planar_state(1e-9 * stamp, 0.0, 0.0), stamp) if data is None else data
        )
        return self.sent[-1] if len(self.sent) > before else None


class DrivenPlant:
    """A plant by the clock, on a backend that does nothing, whose loop is left to the test."""

    def __init__(self, backend: object, *parameters: str) -> None:
        self.codes: list[int] = []
        self.node = PlantNode(
            lambda _robot, _settings: backend,
            self.codes.append,
            cli_args=arguments("autostart:=false", *parameters),
        )
        self.node._run = lambda _backend: None
        assert self.node.trigger_configure() == self.node.trigger_activate()

    def command(self, values: list[float], stamp_ns: int = 0) -> None:
        """Receive a command."""
        self.node.wires.commands._on_command(
            VectorWriter(PLATFORM.actuators.names).raw(np.array(values), stamp_ns)
        )
