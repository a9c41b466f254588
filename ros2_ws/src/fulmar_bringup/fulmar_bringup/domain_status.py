"""Status of the robots and nodes that live in a ROS domain, from their diagnostics and the graph."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node

from fulmar_bringup.node_spec import CONTROLLER, PARTS, PLANT
from fulmar_bringup.node_table import status_names
from fulmar_core.robots.topics import DIAGNOSTICS, ESTOP_TRIGGER
from fulmar_core.safety.arbiter import Mode, asks_for_a_goal
from fulmar_core.safety.estop import HOLDS, SILENT
from fulmar_core.safety.watchdog import NO_COMMAND
from fulmar_core.wires.robot_name import FLEET, namespace_of
from fulmar_ros.operator_subscription import subscribe_every
from fulmar_ros.runtime import ros_node

NODES, REPORTING = status_names(), status_names(silent=False)
SETTLE_S = 0.25  # after the last node was discovered, for others
LOOK_S = 0.02
WAIT_LOOK_S = 0.1
LEVELS = {DiagnosticStatus.OK: "ok", DiagnosticStatus.WARN: "warn", DiagnosticStatus.ERROR: "error"}


@dataclass(frozen=True)
class NodeStatus:
    """Newest status of one node; one that is in the graph and does not report has the level `silent`."""

    node: str
    level: str  # ok, warn, error, silent or absent
    mode: str = ""
    reason: str = ""
    age_s: float | None = None  # of its newest diagnostics [s]
    host: str = ""
    pid: int | None = None

    def well(self, *, alone: bool = False) -> bool:
        """Whether it is there and works.

        An e-stop is no error of a node. Nor are missing commands an error of a plant that is asked about `alone`: it is
        up, in its safe state, and obeys the next controller.
        """
        designed = self.reason.startswith(HOLDS) or (
            alone and self.node == PLANT and self.reason.startswith(NO_COMMAND)
        )
        return self.level in ("ok", "warn") or (self.level == "error" and designed)

    @property
    def takes_goals(self) -> bool:
        """Whether it is a controller that follows a goal, or waits for one."""
        acts = self.mode == Mode.ACTIVE.value
        return self.node == CONTROLLER and (
            acts or (self.mode == Mode.ARMED.value and asks_for_a_goal(self.reason))
        )


@dataclass(frozen=True)
class RobotStatus:
    """One robot."""

    name: str
    estop: str  # pressed, silent, released, or none: no e-stop node runs and none is pressed
    nodes: list[NodeStatus] = field(default_factory=list)
    estop_by: str = ""  # who pressed, as far as the plant knows
    controller: str = ""  # what controls now, by name
    goal_by: str = ""  # who gave the goal that counts, as far as the controller knows
    swap: str = ""  # what became of the last request to change the controller

    @property
    def active(self) -> bool:
        """Whether its controller takes goals."""
        return any(node.takes_goals for node in self.nodes)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {**asdict(self), "active": self.active}


def all_active(robots: Sequence[RobotStatus]) -> bool:
    """Whether there are robots, and the controller of each takes goals."""
    return bool(robots) and all(robot.active for robot in robots if robot.name != FLEET)


def domain_status(
    name: str | None,
    wanted: str | None,
    *,
    timeout_s: float,
    until: Callable[[Sequence[RobotStatus]], bool] | None = None,
) -> list[RobotStatus]:
    """Look until every discovered node of every robot has reported, or the time is over.

    Args:
        name: Name of the only robot to look for; None for all.
        wanted: The only node to look for; it is awaited until the time is over.
        timeout_s: Longest look [s].
        until: What is awaited instead of all reports, such as `all_active`.

    Returns:
        Robots by name, each with its plant, its controller and the other nodes that were found, or with the wanted
        node alone.
    """
    errors: list[Exception] = []
    with ros_node("status", errors.append) as node:
        look = _Look(node, name, wanted)
        until_s = time.monotonic() + timeout_s
        complete = look.complete if until is None else lambda: look.settled() and until(look.robots())
        while not (errors or complete() or time.monotonic() > until_s):
            time.sleep(LOOK_S if until is None else WAIT_LOOK_S)
        return look.robots()


def _parts_of(robot: str) -> tuple[str, ...]:
    """Nodes that every robot has; what robots of a fleet share is no robot."""
    return () if robot == FLEET else PARTS


class _Look:
    """What has been found so far."""

    def __init__(self, node: Node, name: str | None, wanted: str | None) -> None:
        self._node, self._name, self._wanted = node, name, wanted
        self._reports: dict[tuple[str, str], tuple[DiagnosticStatus, float]] = {}
        self._graph: set[tuple[str, str]] = set()
        self._changed_s = time.monotonic()
        subscribe_every(node, DiagnosticArray, DIAGNOSTICS, self._on_diagnostics)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        stamp_s = message.header.stamp.sec + message.header.stamp.nanosec / 1e9
        for status in message.status:
            robot, _, node = status.name.partition(": ")
            if node in REPORTING and self._name in (None, robot):
                self._reports[robot, node] = status, stamp_s

    def complete(self) -> bool:
        """Whether nothing is awaited any more."""
        if self._wanted is not None and self._wanted in REPORTING:
            robots = {robot for robot, node in self._reports if node == self._wanted}
            return bool(robots) and (self._name is not None or self.settled())
        if self._wanted is not None:
            return bool(self._discovered()) and self.settled()
        return bool(self._reports) and self.settled() and not self._silent()

    def settled(self) -> bool:
        """Whether no node was discovered for a while."""
        found = self._discovered()
        if found != self._graph:
            self._graph, self._changed_s = found, time.monotonic()
        return time.monotonic() - self._changed_s > SETTLE_S

    def _discovered(self) -> set[tuple[str, str]]:
        """Robots and nodes in the graph, of the robot and the node that were asked for."""
        found = {(space.strip("/"), node) for node, space in self._node.get_node_names_and_namespaces()}
        robots = {robot for robot, node in found if node in REPORTING}
        kinds = {self._wanted} if self._wanted else set(NODES)
        return {
            (robot, node)
            for robot, node in found
            if robot in robots and node in kinds and self._name in (None, robot)
        }

    def _silent(self) -> set[tuple[str, str]]:
        """Nodes that have not reported yet, plant and controller of each robot among them, discovered or not."""
        robots = {robot for robot, _ in self._graph | self._reports.keys()}
        parts = {(robot, part) for robot in robots for part in _parts_of(robot)}
        return {each for each in self._graph | parts if each[1] in REPORTING} - self._reports.keys()

    def robots(self) -> list[RobotStatus]:
        """Every robot that was found."""
        self._graph = self._discovered()
        names = {robot for robot, _ in self._graph | self._reports.keys()}
        return [self._robot(name) for name in sorted(names)]

    def _robot(self, name: str) -> RobotStatus:
        kinds = {node for robot, node in self._graph | self._reports.keys() if robot == name}
        kinds = {self._wanted} if self._wanted else kinds | set(_parts_of(name))
        nodes = [self._status(name, node) for node in NODES if node in kinds]
        plant, controller = self._values(name, PLANT), self._values(name, CONTROLLER)
        said = {key: controller.get(key, "") for key in ("controller", "goal_by", "swap")}
        return RobotStatus(name, self._estop(name), nodes, estop_by=plant.get("estop_by", ""), **said)

    def _values(self, robot: str, node: str) -> dict[str, str]:
        """Values of the newest status of a node; none before its first."""
        if (robot, node) not in self._reports:
            return {}
        return {pair.key: pair.value for pair in self._reports[robot, node][0].values}

    def _status(self, robot: str, node: str) -> NodeStatus:
        if (robot, node) not in self._reports:
            there = (robot, node) in self._graph
            silent = "silent" if node in REPORTING else "ok"  # an emulator publishes no diagnostics
            return NodeStatus(node, silent if there else "absent")
        status, stamp_s = self._reports[robot, node]
        values = self._values(robot, node)
        return NodeStatus(
            node,
            LEVELS.get(status.level, "error"),
            values.get("mode", ""),
            "" if status.message == values.get("mode") else status.message,
            round(max(0.0, time.time() - stamp_s), 3),
            values.get("host", ""),
            int(values["pid"]) if values.get("pid", "").isdecimal() else None,
        )

    def _estop(self, robot: str) -> str:
        for node in PARTS:
            if (robot, node) in self._reports:
                reason = self._reports[robot, node][0].message
                if reason.startswith(HOLDS):
                    return "silent" if reason.startswith(SILENT) else "pressed"
        button = f"{namespace_of(robot)}/{ESTOP_TRIGGER}"
        services = {service for service, _ in self._node.get_service_names_and_types()}
        return "released" if button in services else "none"
