"""`fulmar status`: robots and nodes in the ROS domain, and whether they are well."""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING, Annotated

import typer

from fulmar_bringup.console import console, log_line, print_json, write_line
from fulmar_cli.commands.arguments import JsonOption, argument, option
from fulmar_core.config.errors import DONE, FAILED, ConfigError, UnknownNameError

if TYPE_CHECKING:
    from fulmar_bringup.domain_status import NodeStatus, RobotStatus


ACTIVE = "active"  # what can be awaited
TIMEOUT_S, WAIT_S = 3.0, 60.0
NO_REPORT = ("silent", "absent")  # levels of nodes that have not reported


def status(
    name: Annotated[str | None, argument("[NAME]", "Name of the only robot; every one by default.")] = None,
    node: Annotated[str | None, option("plant|controller|...", "The only node to look for.")] = None,
    wait: Annotated[
        str | None,
        option("active", "Wait until the controller of the robot, or of each that is found, takes goals."),
    ] = None,
    timeout: Annotated[
        float | None,
        option(
            "S",
            f"Longest wait for a node that does not report; {TIMEOUT_S:g} by default, {WAIT_S:g} with --wait.",
            min=0.1,
            max=3600.0,
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """List the robots and nodes of this ROS domain: level, mode, reason, and the age of their diagnostics.

    Beside each robot: its e-stop and who pressed it, its controller and the last request to change that, and who gave
    the goal that counts.

    A health check for containers and services: it ends as soon as every node has reported. Exit code: 0 all well; 1 a
    node does not report or is in error, or no robot is found. A pressed e-stop is no error. With --node plant missing
    commands are none either: the plant is up, in its safe state, and obeys the next controller.

    With --wait active it waits until the controller takes goals, which it does from its start on, once it receives
    odometry and no e-stop is pressed: a goal that is published before may be lost. Exit code: 0 it takes goals, 1 it
    does not within the timeout.

    Try:

    fulmar status

    fulmar status floating_platform --node plant

    fulmar status floating_platform --wait active --timeout 30
    """
    from fulmar_bringup.domain_status import NODES, all_active, domain_status

    if node is not None and node not in NODES:
        raise UnknownNameError("node", node, NODES)
    if wait is not None and wait != ACTIVE:
        raise UnknownNameError("state of --wait", wait, (ACTIVE,))
    if wait and node:
        raise ConfigError("--wait active waits for a controller; it takes no --node. Leave one of them out.")
    timeout = timeout or (WAIT_S if wait else TIMEOUT_S)
    began_s = time.monotonic()
    robots = domain_status(name, node, timeout_s=timeout, until=all_active if wait else None)
    well = bool(robots) and all(one.well(alone=node is not None) for robot in robots for one in robot.nodes)
    if as_json:
        print_json(
            {"well": well, "active": all_active(robots), "robots": [robot.as_dict() for robot in robots]}
        )
    elif not robots:
        what = (node or "robot") + (f" of '{name}'" if name and node else f" '{name}'" if name else "")
        domain = os.environ.get("ROS_DOMAIN_ID") or "0"
        console.print(
            f"no {what} is found in ROS domain {domain} within {timeout:g} s. Check ROS_DOMAIN_ID and "
            "ROS_AUTOMATIC_DISCOVERY_RANGE; between hosts also ROS_STATIC_PEERS.",
            markup=False, soft_wrap=True,
        )  # fmt: skip
    for robot in robots if not as_json else ():
        _show(robot, time.monotonic() - began_s)
        if wait and not robot.active:
            log_line(f"the controller of '{robot.name}' takes no goals within {timeout:g} s.")
    raise typer.Exit(DONE if (all_active(robots) if wait else well) else FAILED)


def _show(robot: RobotStatus, looked_s: float) -> None:
    parts = (
        f"e-stop: {robot.estop}" + (f" by {robot.estop_by}" if robot.estop_by else ""),
        robot.controller and f"controller: {robot.controller}",
        robot.goal_by and f"goal by {robot.goal_by}",
        robot.swap and f"swap: {robot.swap}",
    )
    write_line("  ".join((robot.name, *filter(None, parts))))
    width = max([11, *(len(node.node) + 1 for node in robot.nodes)])
    for node in robot.nodes:
        level = "?" if node.level in NO_REPORT else node.level
        write_line(f"  {node.node:<{width}}{level:<7}{_words(node, looked_s)}")


def _words(node: NodeStatus, looked_s: float) -> str:
    if node.level in NO_REPORT:
        there = ", though it is there" if node.level == "silent" else ""
        return f"no report within {looked_s:.1f} s{there}"
    age = "" if node.age_s is None else f"{node.age_s:.1f} s ago"
    place = f"process {node.pid} on {node.host}" if node.pid else ""
    return ", ".join(filter(None, (node.mode, node.reason, age, place)))
