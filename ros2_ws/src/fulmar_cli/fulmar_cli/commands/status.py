"""`fulmar status`: robots and nodes in the ROS domain, and whether they are well."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Annotated

import typer

from fulmar_bringup.console import console, output, print_json
from fulmar_cli.commands.arguments import JsonOption, argument, option
from fulmar_core.config.errors import DONE, FAILED, UnknownNameError

if TYPE_CHECKING:
    from fulmar_bringup.domain_status import NodeStatus, RobotStatus


def status(
    name: Annotated[str | None, argument("[NAME]", "Name of the only robot; every one by default.")] = None,
    node: Annotated[str | None, option("plant|controller|...", "The only node to look for.")] = None,
    timeout: Annotated[
        float, option("S", "Longest wait for a node that does not report.", min=0.1, max=60.0)
    ] = 3.0,
    as_json: JsonOption = False,
) -> None:
    """List the robots and nodes of this ROS domain: level, mode, reason, e-stop, and the age of their diagnostics.

    A health check for containers and services: it ends as soon as every node that is discovered has reported. Exit
    code: 0 all well; 1 a node is absent, silent or in error, or no robot is found. A pressed e-stop is no error. With
    --node plant missing commands are none either: the plant is up, in its safe state, and obeys the next controller.

    Try:

    fulmar status

    fulmar status floating_platform --node plant
    """
    from fulmar_bringup.domain_status import NODES, domain_status

    if node is not None and node not in NODES:
        raise UnknownNameError("node", node, NODES)
    robots = domain_status(name, node, timeout_s=timeout)
    well = bool(robots) and all(one.well(alone=node is not None) for robot in robots for one in robot.nodes)
    if as_json:
        print_json({"well": well, "robots": [robot.as_dict() for robot in robots]})
    elif not robots:
        what = (node or "robot") + (f" of '{name}'" if name and node else f" '{name}'" if name else "")
        domain = os.environ.get("ROS_DOMAIN_ID") or "0"
        console.print(
            f"no {what} is found in ROS domain {domain} within {timeout:g} s. Check ROS_DOMAIN_ID and "
            "ROS_AUTOMATIC_DISCOVERY_RANGE; between hosts also ROS_STATIC_PEERS.",
            markup=False, soft_wrap=True,
        )  # fmt: skip
    for robot in robots if not as_json else ():
        _show(robot)
    raise typer.Exit(DONE if well else FAILED)


def _show(robot: RobotStatus) -> None:
    output.print(f"{robot.name}  e-stop: {robot.estop}", markup=False)
    width = max([11, *(len(node.node) + 1 for node in robot.nodes)])
    for node in robot.nodes:
        output.print(f"  {node.node:<{width}}{node.level:<7}{_words(node)}", markup=False, soft_wrap=True)


def _words(node: NodeStatus) -> str:
    age = "" if node.age_s is None else f"{node.age_s:.1f} s ago"
    place = f"process {node.pid} on {node.host}" if node.pid else ""
    return ", ".join(filter(None, (node.mode, node.reason, age, place)))
