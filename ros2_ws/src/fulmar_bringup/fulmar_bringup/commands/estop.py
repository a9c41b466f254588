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

    A robot that runs without an e-stop node is stopped too, and stays so until one is started and says otherwise. After
    a reset controllers wait for a new goal. Exit code 1 if a robot could not be stopped, or a reset was refused.

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
        for space in spaces:
            done, words = person.ask(f"{space}/{service}")
            answers.append({"robot": space.strip("/"), "done": done, "said": words})
        if not reset:  # the wire itself stops those that run without a node for it
            for space in person.plants(robot, wait_s=0.5 if spaces else FIND_S):
                if space not in spaces:
                    heard = person.say_stop(space)
                    words = "stopped, without an e-stop node: it stays so until one says otherwise"
                    words = words if heard else "nobody hears it: cut the power"
                    answers.append({"robot": space.strip("/"), "done": heard, "said": words})
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
