"""`fulmar estop`: stop every robot that is heard, or one; and reset."""

from __future__ import annotations

from typing import Annotated

import typer

from fulmar_bringup.commands.arguments import JsonOption
from fulmar_bringup.console import console, output, print_json
from fulmar_core.errors import RunFailed
from fulmar_core.exit_codes import FAILED


def estop(
    robot: Annotated[
        str | None, typer.Argument(metavar="[ROBOT]", help="Only this robot; every one by default.")
    ] = None,
    reset: Annotated[
        bool, typer.Option("--reset", help="Release it; refused while commands are not zero.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Press the emergency stop of every robot in this ROS domain: actuators go to their safe state, at once.

    A robot whose e-stop node hangs, or that runs without one, is stopped too, and stays so until one is started and
    reset. After a reset controllers wait for a new goal. Exit code 1 if a robot could not be stopped, or a reset was
    refused.

    Try:

    fulmar estop

    fulmar estop floating_platform --reset
    """
    from fulmar_bringup.robot_operator import FIND_S, operator
    from fulmar_core.topics import ESTOP_RESET, ESTOP_TRIGGER

    service = ESTOP_RESET if reset else ESTOP_TRIGGER
    answers = []
    with operator() as person:
        spaces = person.robots_with(service, robot, wait_s=FIND_S)
        asked = {space: f"{space}/{service}" for space in spaces}
        heard: set[str] = set()
        if reset:
            said = person.ask_all(list(asked.values()))
        else:  # the wire itself stops those that run without a node for it, or with one that hangs
            spaces = sorted({*spaces, *person.plants(robot, wait_s=0.5 if spaces else FIND_S)})
            heard, said = person.stop_all(spaces, list(asked.values()))
        for space in spaces:
            done, words = said.get(asked.get(space, "")) or _unanswered(space in asked, space in heard)
            answers.append({"robot": space.strip("/"), "done": done, "said": words})
    if not answers:
        whom = f"'{robot}'" if robot else "any robot"
        raise RunFailed(
            f"no e-stop of {whom} is heard in this ROS domain. Check ROS_DOMAIN_ID and ROS_AUTOMATIC_DISCOVERY_RANGE, "
            "or cut the power."
            if not reset
            else f"no e-stop node of {whom} is heard in this ROS domain. Start one: "
            "python -m fulmar_ros.estop_node --ros-args -r __ns:=/ROBOT -p robot:=ROBOT"
        )
    if as_json:
        print_json({"robots": answers})
    for answer in answers if not as_json else ():
        where = output if answer["done"] else console
        where.print(f"{answer['robot']}: {answer['said']}", markup=False)
    if not all(answer["done"] for answer in answers):
        raise typer.Exit(FAILED)


def _unanswered(has_node: bool, heard: bool) -> tuple[bool, str]:
    """Whether a robot is stopped whose e-stop node says nothing, or that has none; and words for it."""
    node = "its e-stop node does not answer" if has_node else "it has no e-stop node"
    if heard:
        return True, f"stopped on the wire, since {node}: it stays so until one is started and reset"
    return False, f"{node}, and nobody hears the wire: cut the power"
