"""`fulmar estop`: stop every robot in the ROS domain, or one; and reset."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from fulmar_bringup.console import console, output, print_json
from fulmar_cli.commands.arguments import JsonOption, argument, flag
from fulmar_core.config.errors import FAILED, RunFailed

if TYPE_CHECKING:
    from fulmar_bringup.estop_robots import Stopped


def estop(
    robot: Annotated[
        str | None, argument("[ROBOT]", "Name of the only robot to stop; every one by default.")
    ] = None,
    reset: Annotated[
        bool, flag("--reset", "Release the e-stop; refused while commands are not zero.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Press the emergency stop of every robot in this ROS domain: actuators go to their safe state, at once.

    A robot whose e-stop node hangs, or that runs without one, is stopped too. Every press holds until a reset, which a
    robot without an e-stop node takes as well. After a reset controllers wait for a new goal. Exit code 1 if a robot
    could not be stopped, or a reset was refused.

    Try:

    fulmar estop

    fulmar estop floating_platform --reset
    """
    from fulmar_bringup.robot_operator import operator

    with operator() as person:
        if reset:
            came = person.reset_all(robot)
        else:
            came = {one.space: one.answer or _unanswered(one) for one in person.stop_all(robot)}
        others = f" {person.running_robots_text()}" if robot and not came else ""
    answers = [
        {"robot": space.strip("/"), "done": done, "said": words} for space, (done, words) in came.items()
    ]
    if not answers:
        whom = f"'{robot}'" if robot else "any robot"
        raise RunFailed(
            f"no plant and no e-stop node of {whom} is found in this ROS domain. Check ROS_DOMAIN_ID, "
            "ROS_AUTOMATIC_DISCOVERY_RANGE and, for a robot of another host, ROS_STATIC_PEERS"
            + (", or cut the power." if not reset else ".")
            + others
        )
    if as_json:
        print_json({"robots": answers})
    for answer in answers if not as_json else ():
        where = output if answer["done"] else console
        where.print(f"{answer['robot']}: {answer['said']}", markup=False)
    if not all(answer["done"] for answer in answers):
        raise typer.Exit(FAILED)


def _unanswered(robot: Stopped) -> tuple[bool, str]:
    """Whether a robot whose e-stop node does not answer is stopped, and a message."""
    if robot.reached:
        return (
            True,
            "stopped by topic, since no e-stop node answers; it stays stopped until `fulmar estop --reset`",
        )
    return False, "no e-stop node answers, and nothing subscribes to the e-stop topic: cut the power"
