"""`fulmar simulation`: pause, step, slow down and disturb a simulated robot that runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

import typer

from fulmar_bringup.console import print_json, write_line
from fulmar_cli.commands.arguments import JsonOption, argument, option
from fulmar_core.config.errors import FAILED
from fulmar_core.config.paths import config_names
from fulmar_core.wires.robot_name import checked_name

if TYPE_CHECKING:
    from fulmar_bringup.robot_operator import Operator
    from fulmar_bringup.simulation_requests import SimulationAnswer

simulation = typer.Typer(
    help="Pause, step, slow down and disturb a simulated robot that runs; exit code 1 where the plant refuses.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
Running = Annotated[str, argument("ROBOT", "Name of the running robot: its type, or its --name.")]


@simulation.command()
def pause(robot: Running, as_json: JsonOption = False) -> None:
    """Let simulated time stand still; the e-stop works meanwhile.

    Try:

    fulmar simulation pause floating_platform
    """
    from fulmar_bringup.simulation_requests import ask_to_pause

    _ask(robot, as_json, lambda person: ask_to_pause(person, robot, True))


@simulation.command()
def resume(robot: Running, as_json: JsonOption = False) -> None:
    """Let a paused simulation go on.

    Try:

    fulmar simulation resume floating_platform
    """
    from fulmar_bringup.simulation_requests import ask_to_pause

    _ask(robot, as_json, lambda person: ask_to_pause(person, robot, False))


@simulation.command()
def step(
    robot: Running,
    steps: Annotated[int, option("N", "How many control steps.", min=1)] = 1,
    as_json: JsonOption = False,
) -> None:
    """Simulate one control step of a paused robot, or several.

    Try:

    fulmar simulation step floating_platform --steps 10
    """
    from fulmar_bringup.simulation_requests import ask_for_steps

    _ask(robot, as_json, lambda person: ask_for_steps(person, robot, steps))


@simulation.command()
def rate(
    robot: Running,
    speed: Annotated[float, argument("RATE", "Simulated seconds a second of the wall clock.")],
    as_json: JsonOption = False,
) -> None:
    """Simulate more slowly than the robot was started with, or as fast again.

    Try:

    fulmar simulation rate floating_platform 0.5
    """
    from fulmar_bringup.simulation_requests import ask_for_rate

    _ask(robot, as_json, lambda person: ask_for_rate(person, robot, speed))


@simulation.command()
def disturb(
    robot: Running,
    what: Annotated[
        str, argument("WHAT", "push, gust, dead, stuck, noise, cut_link, or clear, which ends all.")
    ],
    fields: Annotated[
        list[str] | None,
        argument("[FIELD=VALUE...]", "Such as force_n=3,0 seconds=1; docs/simulation.md has all."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Push a simulated robot, break one of its actuators, add noise, or cut its link.

    A field that is left out has its default. What was done stands in bags with the step from which on it acts.

    Try:

    fulmar simulation disturb floating_platform push force_n=2,0 seconds=1

    fulmar simulation disturb floating_platform dead actuator=valve_1
    """
    from fulmar_bringup.simulation_requests import ask_to_disturb, read_fields

    given = read_fields(fields or [])
    _ask(robot, as_json, lambda person: ask_to_disturb(person, robot, what, given))


def _ask(robot: str, as_json: bool, request: Callable[[Operator], SimulationAnswer]) -> None:
    """Ask, say what came back, and end with code 1 where it was refused."""
    from fulmar_bringup.robot_operator import operator

    if robot not in config_names("robots"):
        checked_name(robot)
    with operator() as person:
        answer = request(person)
    if as_json:
        print_json({"robot": robot, "done": answer.accepted, "reason": answer.reason})
    else:
        write_line(answer.reason or "done" if answer.accepted else f"refused: {answer.reason}")
    if not answer.accepted:
        raise typer.Exit(FAILED)
